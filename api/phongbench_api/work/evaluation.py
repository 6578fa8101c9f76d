"""Highlights and curves on request: the requested formula, checked, then evaluated by the library's kernels."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas import curves
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel, evaluate
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation, Setting
from phongbench_api.http import arrays
from phongbench_api.http.problems import Cancelled, RequestError, request_errors
from phongbench_api.models import FormulaParameters

#: pairs between two looks at whether the client is still there; a tile of float32 pairs stays in a second-level cache
TILE = 1 << 15
PHONG = Formula.of("phong")


@dataclass(frozen=True, slots=True)
class Lobe:
    """A formula at an exponent."""

    formula: Formula
    alpha: float

    @property
    def spec(self) -> Approximation:
        """The formula's entry in the registry."""
        return self.formula.spec()

    @property
    def form(self) -> str:
        """Its lambda form."""
        return self.formula.lambda_form

    @property
    def setting(self) -> Setting:
        """What its coefficients are made for."""
        return self.formula.setting(self.alpha)


def requested(parameters: FormulaParameters) -> Lobe:
    """The formula of a request, by its spelling or its parts; RequestError names the field that is wrong."""
    p = parameters
    return _lobe(p.alpha, p.formula, p.approximation, p.lambda_form, p.gamma, p.beta, p.space)


@lru_cache(maxsize=1024)
def _lobe(
    alpha: float,
    spelling: str | None,
    approximation: str | None,
    form: str | None,
    gamma: int | None,
    slope: str | None,
    space: str | None,
) -> Lobe:
    parts = (approximation, form, gamma, slope, space)
    if spelling is not None:
        if parts != (None,) * len(parts):
            raise RequestError("is given beside approximation, lambda, gamma, beta or space", "formula", "give one")
        with request_errors("formula"):
            formula = Formula.parse(spelling)
    elif approximation is None:
        raise RequestError("is missing", "approximation", "give it, or a whole formula, e.g. formula=lyon:cross:8")
    elif gamma is not None and not REGISTRY[approximation].uses_gamma:
        raise RequestError(f"{approximation} takes no gamma", "gamma", "leave it out")
    else:
        with request_errors():
            formula = Formula.of(approximation, form, gamma, slope, space)
    with request_errors("formula"):
        formula.check_pair()
    with request_errors("alpha"):
        formula.check(alpha)
    return Lobe(formula, alpha)


@lru_cache(maxsize=1024)
def kernel(lobe: Lobe, precision: Precision) -> Kernel:
    """The loop over pairs of shape (n, 3) with its coefficients, compiled if it was not."""
    normalise = lobe.formula.normalise
    return Kernel.of_pairs(lobe.spec, lobe.form, lobe.setting, precision, "aos", normalise=normalise)


def values(
    lobe: Lobe, a: Array, b: Array, precision: Precision, cancelled: Callable[[], bool] = lambda: False
) -> Array:
    """Highlights of pairs.

    a, b       (n, 3)  directions; may be read-only, not copied if they have the precision's type
    cancelled  called between tiles; Cancelled is raised once it says yes
    returns    (n,)    in the precision's carrier; RequestError names the first vector that is not finite
    """
    loop = kernel(lobe, precision)
    out = np.empty(len(a), precision.carrier)
    for start in range(0, len(a), TILE):
        if cancelled():
            raise Cancelled
        piece = slice(start, start + TILE)
        for field, vectors in (("a", a[piece]), ("b", b[piece])):
            arrays.check_finite(vectors, field, start)
        loop.fill_pairs(a[piece], b[piece], out[piece])
    return out


def compared(lobe: Lobe, a: Array, b: Array, approximate: Array, cancelled: Callable[[], bool]) -> dict[str, Any]:
    """The exact term of the vectors as they are, in float64, and where the approximate values are farthest from it."""
    exact = _exact(lobe.setting, a, b, cancelled)
    error = np.abs(approximate - exact)
    worst = int(error.argmax()) if len(error) else None
    largest = 0.0 if worst is None else error[worst]
    return {"exact": exact, "max_abs_error": largest, "worst_index": worst}


def _exact(setting: Setting, a: Array, b: Array, cancelled: Callable[[], bool]) -> Array:
    """Exact Phong; of pairs (N, H), Phong at twice their angle, the coplanar configuration."""
    if setting.space == "reflect":
        return values(Lobe(PHONG, setting.alpha), a, b, FLOAT64, cancelled)
    cosine = np.einsum("ij,ij->i", a, b, dtype=np.float64)
    return evaluate(PHONG.spec(), Setting(setting.alpha), 2 * cosine * cosine - 1, cosine)


def curve(
    lobe: Lobe, angle: Array, precision: Precision = FLOAT64, perturbation: str = "none", length_error: float = 0.0
) -> dict[str, Any]:
    """Value, exact value and error at angles between R and V in degrees, and what they amount to.

    In float64 with right lengths the formula is evaluated at the angles themselves; else with vectors as `precision`
    holds them, and exact Phong is of the true angle between those.
    """
    spec, form, setting = lobe.spec, lobe.form, lobe.setting
    normalise = lobe.formula.normalise
    value, exact = curves.against_exact(
        spec, form, setting, angle, precision, perturbation, length_error, normalise=normalise
    )
    error = value - exact
    size = np.where(np.isfinite(error), np.abs(error), np.inf)
    worst = int(size.argmax())
    return {
        "name": str(lobe.formula),
        "angle_degrees": angle,
        "value": value,
        "exact": exact,
        "error": error,
        "max_abs_error": size[worst],
        "worst_index": worst,
        "beta": spec.coefficients(setting).get("beta"),
        "cutoff_degrees": curves.cutoff_degrees(spec, form, setting),
    }
