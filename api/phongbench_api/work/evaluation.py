"""Highlights and curves on request: the asked formula, found and checked, then evaluated by the library's kernels."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT64, Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas import curves
from phongbench.formulas.formula import cell_name
from phongbench.formulas.kernel import Kernel, evaluate
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting
from phongbench_api.http import media
from phongbench_api.http.problems import Cancelled, RequestError
from phongbench_api.models import FormulaAsk

#: pairs between two looks at whether the client is still there; a tile of float32 pairs stays in a second-level cache
TILE = 1 << 15


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula at a setting, with its lambda form."""

    spec: Approximation
    form: str
    setting: Setting


@lru_cache(maxsize=1024)
def formula_of(
    approximation: str, form: str | None, gamma: int | None, alpha: float, policy: str | None, space: str | None
) -> Formula:
    """The formula asked for, with its own defaults for what was left out; RequestError names the wrong field."""
    spec = REGISTRY[approximation]
    if form is not None and form not in spec.lambda_forms:
        raise RequestError(f"{spec.name} has the forms {', '.join(spec.lambda_forms)}", "lambda")
    if spec.uses_gamma != (gamma is not None):
        raise RequestError(f"{spec.name} {'needs a' if spec.uses_gamma else 'takes no'} gamma", "gamma")
    setting = Setting(alpha, gamma, policy or spec.slopes[0], space or spec.spaces[0])
    try:
        spec.check(setting)
    except UnknownNameError as problem:
        field = {"beta policy": "beta"}.get(problem.kind, problem.kind)
        raise RequestError(f"{spec.name} has {', '.join(problem.known)}", field) from None
    except InputError as problem:
        raise RequestError(
            problem.what, "gamma" if problem.what.startswith("gamma") else "alpha", problem.fix
        ) from None
    return Formula(spec, form or spec.lambda_forms[0], setting)


def asked(ask: FormulaAsk) -> Formula:
    """The formula of a request."""
    return formula_of(ask.approximation, ask.lambda_form, ask.gamma, ask.alpha, ask.beta, ask.space)


def name_of(formula: Formula) -> str:
    """The formula's name for people: "lyon, cross, gamma 8, minimax"."""
    s = formula.setting
    cell = {"approximation": formula.spec.name, "lambda_form": formula.form, "gamma": s.gamma}
    return cell_name(cell | {"beta_policy": s.slope, "space": s.space})


def values(
    formula: Formula, a: Array, b: Array, precision: Precision, cancelled: Callable[[], bool] = lambda: False
) -> Array:
    """Highlights of pairs.

    a, b       (n, 3)  directions; may be read-only, not copied if they have the precision's type
    cancelled  asked between tiles; Cancelled is raised once it says yes
    returns    (n,)    in the precision's carrier; RequestError names the first vector that is not finite
    """
    run = prepared(formula, precision.name)
    out = np.empty(len(a), precision.carrier)
    for start in range(0, len(a), TILE):
        if cancelled():
            raise Cancelled
        piece = slice(start, start + TILE)
        for field, given in (("a", a[piece]), ("b", b[piece])):
            _check(given, field, start)
        run(a[piece], b[piece], out[piece])
    return out


def compared(formula: Formula, a: Array, b: Array, found: Array, cancelled: Callable[[], bool]) -> dict[str, Any]:
    """The exact term of the vectors as they are, in float64, and where the found values are farthest from it."""
    exact = _exact(formula.setting, a, b, cancelled)
    error = np.abs(found - exact)
    worst = int(error.argmax()) if len(error) else None
    largest = 0.0 if worst is None else error[worst]
    return {"exact": exact, "max_abs_error": largest, "worst_index": worst}


def curve(
    formula: Formula,
    angle: Array,
    precision: Precision = FLOAT64,
    perturbation: str = "none",
    length_error: float = 0.0,
) -> dict[str, Any]:
    """Value, exact value and error at angles between R and V in degrees, and what they amount to.

    In float64 with right lengths the formula is evaluated at the angles themselves; else with vectors as `precision`
    holds them, and exact Phong is of the true angle between those.
    """
    spec, form, setting = formula.spec, formula.form, formula.setting
    value, exact = curves.against_exact(spec, form, setting, angle, precision, perturbation, length_error)
    error = value - exact
    size = np.where(np.isfinite(error), np.abs(error), np.inf)
    worst = int(size.argmax())
    return {
        "angle_degrees": angle,
        "value": value,
        "exact": exact,
        "error": error,
        "max_abs_error": size[worst],
        "worst_index": worst,
        "beta": spec.coefficients(setting).get("beta"),
        "cutoff_degrees": curves.cutoff_degrees(spec, form, setting),
    }


def prepared(formula: Formula, precision: str) -> Callable[[Array, Array, Array], None]:
    """A formula's kernel with its coefficients, compiled if it was not: (a, b, out) of (n, 3), (n, 3), (n,)."""
    return _prepared(formula.spec.name, formula.form, formula.setting, precision)


@lru_cache(maxsize=1024)
def _prepared(name: str, form: str, setting: Setting, precision: str) -> Callable[[Array, Array, Array], None]:
    return Kernel.of_pairs(REGISTRY[name], form, setting, precision_named(precision), "aos").fill_pairs


def _check(given: Array, field: str, start: int) -> None:
    try:
        media.check_finite(given, field)
    except RequestError as problem:
        index = start + (problem.index or 0)
        raise RequestError(f"vector {index} is not finite", field, problem.fix, index=index) from None


def _exact(setting: Setting, a: Array, b: Array, cancelled: Callable[[], bool]) -> Array:
    """Exact Phong; of pairs (N, H), Phong at twice their angle, the coplanar configuration."""
    phong = REGISTRY["phong"]
    if setting.space == "reflect":
        return values(Formula(phong, phong.lambda_forms[0], Setting(setting.alpha)), a, b, FLOAT64, cancelled)
    cosine = np.einsum("ij,ij->i", a, b, dtype=np.float64)
    return evaluate(phong, Setting(setting.alpha), 2 * cosine * cosine - 1, cosine)
