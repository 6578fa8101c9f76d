"""A formula's code with what is known of it from above: the error that is promised, and what it costs on targets."""

from collections.abc import Iterable, Mapping
from typing import Any

from phongbench.analysis.promises import bound_at
from phongbench.analysis.target_costs import CPU, checked
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import OVER_LONG, Options, Shader, shader
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.targets.code_shapes import code
from phongbench.targets.costs import shipped
from phongbench.targets.measure import costs as compiled_costs


def ready_code(
    formula: Formula,
    alpha: float,
    options: Options = Options(),  # noqa: B008  frozen
    registry: Registry = REGISTRY,
    *,
    compiles: bool = True,
) -> Shader:
    """The code of a formula, its promise and its costs told at the top.

    compiles  whether code whose cost is not shipped may be compiled here
    Raises what `shader` raises; InputError where a cost is asked for that is not shipped and cannot be compiled here.
    """
    options.checked()
    formula.check(alpha, registry)
    costs = [cost_on(target, formula, alpha, options, registry, compiles=compiles) for target in options.targets]
    bound = None
    if options.precision == FLOAT32:
        bound = bound_at(formula, alpha, registry, length_error=options.length_error)
    return shader(formula, alpha, options, registry=registry, bound=bound, costs=costs, notes=_said(costs))


def cost_on(
    target: str, formula: Formula, alpha: float, options: Options, registry: Registry, *, compiles: bool
) -> Mapping[str, Any]:
    """What the code costs on a compiled target, beyond a dot product: cost, unit, ratio, bound_by, and who said so."""
    if checked(target, None) == CPU:
        fix = "name a compiled one, e.g. rdna2; `phongbench recommend` tells this machine's times"
        raise InputError("code has no cost on cpu, which is timed", "target", fix)
    if options.precision != FLOAT32:
        raise InputError(f"costs on {target} are those of float32 code", "target", "leave the precision out")
    table, limited = shipped(target), options.over_long == OVER_LONG[0]
    wanted = code(formula, alpha, table.target.language, registry, limited=limited)
    found = table.known(wanted)
    if found is None and not compiles:
        fix = "vectors that are limited to 1 have one: leave over_long out, or ask phongbench on your own machine"
        raise InputError(f"no cost of this code on {target} is shipped", "target", fix)
    cost = compiled_costs(table.target, [wanted])[0] if found is None else found
    return {
        "target": target,
        "cost": cost.cost,
        "unit": table.target.unit,
        "cost_kind": "compiled",
        "ratio": table.ratio(cost),
        "bound_by": cost.bound_by,
        "tool": table.target.tool,
        "tool_version": table.tool_version,
    }


def _said(costs: Iterable[Mapping[str, Any]]) -> list[str]:
    """A line for each target."""
    return [
        f"on {c['target']}: {c['cost']:.3g} {c['unit']} beyond the dot product, {c['ratio']:.2g} of exact Phong's"
        f" with it, bound by {c['bound_by']}; counted in what {c['tool']} {c['tool_version']} compiles"
        for c in costs
    ]
