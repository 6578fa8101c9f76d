"""A formula's code with what is known of it from above: the error that is promised, and what it costs on targets."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from phongbench.analysis.exponents import Exponents
from phongbench.analysis.promises import bound_at, contract_at, without_contract
from phongbench.analysis.target_costs import checked, table_of, unit_of
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import OVER_LONG, Options, Shader, shader
from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32
from phongbench.formulas.user_files import installed
from phongbench.results.schema import CPU, GPU
from phongbench.targets import measured
from phongbench.targets.code_shapes import code
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
    language, options = options.checked(), replace(options, targets=tuple(dict.fromkeys(options.targets)))
    formula.check(alpha, registry)
    costs = [cost_on(target, formula, alpha, options, registry, compiles=compiles) for target in options.targets]
    wrong, bound, contract, told = options.length_error, None, None, list[str]()
    if options.precision == FLOAT32:
        bound = bound_at(formula, alpha, registry, length_error=wrong)
    if language.gpu and language.components is None:  # shading languages
        held, limited = FLOAT32 if options.precision == FLOAT32 else FLOAT16, options.over_long == OVER_LONG[0]
        about: Any = (formula, alpha, held, registry)
        contract = contract_at(*about, length_error=wrong, limited=limited)
        if contract is None:
            told = [why] if (why := without_contract(*about, length_error=wrong, limited=limited)) else []
    told += _said(costs)
    return shader(formula, alpha, options, registry=registry, bound=bound, contract=contract, costs=costs, notes=told)


def cost_on(
    target: str, formula: Formula, alpha: float, options: Options, registry: Registry, *, compiles: bool
) -> Mapping[str, Any]:
    """What the code costs on a target: cost, unit, ratio to exact Phong's, who said so, and what limits it."""
    if checked(target, None) == CPU:
        fix = "name another one, e.g. rdna2; `phongbench recommend` tells this machine's times"
        raise InputError("cpu has no cost of a single function: it is timed as a whole", "target", fix)
    if target == GPU:
        fix = "name another one, e.g. rdna2; `phongbench recommend --target gpu` tells a run's times"
        raise InputError("times of gpu are a run's", "target", fix)
    held = FLOAT32 if options.precision == FLOAT32 else FLOAT16  # the least that mediump is
    table, limited = table_of(target, precision=held), options.over_long == OVER_LONG[0]
    wanted = code(formula, alpha, table.language, registry, limited=limited, precision=held)
    tool = table.tool if isinstance(table, measured.MeasuredTable) else table.target.tool
    told = {"target": target, **unit_of(target), "tool": tool, "tool_version": table.tool_version}
    if isinstance(table, measured.MeasuredTable):
        timed = table.known(wanted)
        if timed is None:
            raise InputError(f"this code was not measured on {target}", "target", "measure it in the explorer")
        return {**told, "cost": timed.cost, "ratio": table.ratios(timed)[0], "bound_by": None}
    found = table.known(wanted)
    if found is None and not compiles:
        fix = "vectors that are limited to 1 have one: leave over_long out, or ask phongbench on your own machine"
        raise InputError(f"no cost of this code on {target} is shipped", "target", fix)
    cost = compiled_costs(table.target, [wanted])[0] if found is None else found
    return {**told, "cost": cost.cost, "ratio": table.ratio(cost), "bound_by": cost.bound_by}


def codes_of(answer: Mapping[str, Any], language: str) -> list[dict[str, Any]]:
    """The choice of an answer of `recommend` as source text for each of its exponents: name, alpha, language, code.

    Raises InputError for a range of exponents, which no single function is for, and what `ready_code` raises.
    """
    asked = Exponents.of(answer["alpha"].replace(" ", ""))
    if asked.continuous:
        raise InputError(f"code is written for exponents, not for all in {answer['alpha']}", "alpha", "list some")
    if not answer["choices"]:
        return []
    name, registry = answer["choices"][0]["name"], installed()
    formula = Formula.parse(name, registry)
    options = Options(language, answer["precision"], length_error=answer.get("length_error") or 0.0)
    return [
        {"name": name, "alpha": alpha, "language": language, "code": ready_code(formula, alpha, options, registry).text}
        for alpha in asked.values
    ]


def _said(costs: Iterable[Mapping[str, Any]]) -> list[str]:
    """A line for each target."""

    def by(tool: str, version: str) -> str:
        return version if tool.split(maxsplit=1)[0] in version else f"{tool} {version}"

    return [
        f"on {c['target']}: {c['cost']:.3g} {c['unit']} "
        + (f"beyond the dot product, bound by {c['bound_by']}" if c["bound_by"] else "with the dot product")
        + f", {c['ratio']:.2g} of exact Phong's; {c['cost_kind']} by {by(c['tool'], c['tool_version'])}"
        for c in costs
    ]
