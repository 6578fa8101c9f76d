"""The specular term: which formula stands for it, on which pair of vectors it is evaluated, and where it is dark."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import MODELS, Formula, Registry
from phongbench.formulas.kernel import Kernel, limit
from phongbench.formulas.registry import REGISTRY, guarded
from phongbench.formulas.spec import Approximation, Setting
from phongbench.shading.light_loops import coordinate_loop
from phongbench.shading.lighting import Material, Skips

#: Phong's own power
EXACT = Formula()


def formula_for(formula: Formula, material: Material, model: str = "phong", registry: Registry = REGISTRY) -> Formula:
    """The formula, with what it leaves open filled in, if it can shade this material.

    Raises UnknownNameError or InputError naming the field: model, specular.approximation, specular.lambda,
    specular.gamma, specular.beta, specular.space or material.shininess.
    """
    if model not in MODELS:
        raise UnknownNameError("model", model, MODELS, "model")
    if formula.raw:
        fix = f"give {formula.approximation} without @ and /: shading normalises what it is told to by itself"
        raise InputError(f"{formula} removes lengths or makes its pair, which shading does", "specular", fix)
    parts = (formula.approximation, formula.lambda_form, formula.gamma, formula.slope, formula.space)
    formula = Formula.of(*parts, registry=registry, where="specular.")
    if model == "blinn-phong" and formula.space == "half":
        fix = f'take model "phong" for {formula}, or "phong" for N.H to the shininess itself'
        raise InputError(f"{formula.approximation} is a formula of N.H already", "specular.approximation", fix)
    spec, alpha = formula.spec(registry), material.highlight_exponent
    fits = all(p.low <= alpha <= p.high for p in spec.parameters if p.name == "alpha")
    with guarded(spec):
        try:
            spec.check(formula.setting(alpha))
        except InputError as problem:
            problem.where = "specular.gamma" if spec.uses_gamma and fits else "material.shininess"
            raise
    return formula


@lru_cache(maxsize=64)  # a table takes longer to make than a small request to shade
def _kernel(spec: Approximation, setting: Setting, precision: Precision) -> Kernel:
    with guarded(spec):
        return Kernel.of(spec, setting, precision)


@dataclass(frozen=True)
class SpecularTerm:
    """A formula for one material, as loops evaluate it.

    form   lambda form, "none" for formulas of the cosine
    space  the pair it is evaluated on: "reflect" (R, V) or "half" (N, H)
    dark   the coordinate beyond which a block is left out
    tail   the cosine below which exact Phong counts as dark; 0: nowhere
    """

    spec: Approximation
    setting: Setting
    form: str
    space: str
    precision: Precision
    dark: float
    tail: float

    @classmethod
    def of(
        cls,
        formula: Formula,
        material: Material,
        model: str = "phong",
        *,
        registry: Registry,
        precision: Precision,
        skips: Skips,
    ) -> "SpecularTerm":
        """The term of a material; errors as of `formula_for`.

        Model "phong" evaluates a formula on its own pair. Model "blinn-phong" raises N.H to the material's shininess
        itself: a formula stands for that power as it does for Phong's, with the exponent as it is given.
        """
        formula = formula_for(formula, material, model, registry)
        spec, form = formula.spec(registry), formula.lambda_form
        setting = formula.setting(material.highlight_exponent)
        exact = spec.kind == "exact" and form == "none"
        dark, tail = -np.inf if form == "none" else np.inf, 0.0
        if skips.beyond_support and (exact or spec.cutoff is not None):
            with guarded(spec):
                dark = limit(spec, setting, precision)
        if skips.dark_tail and exact:
            least = 4 * float(np.finfo(precision.carrier).eps) if skips.tail is None else skips.tail
            tail = least ** (1 / setting.alpha) if setting.alpha else 0.0
            dark = max(dark, tail)
        space = "half" if model == "blinn-phong" else formula.space
        return cls(spec, setting, form, space, precision, dark, tail)

    @property
    def reason(self) -> str:
        """What the ledger calls a block that lies in the dark."""
        return "dark_tail" if self.tail > 0 else "beyond_support"

    @property
    def kernel(self) -> Kernel:
        """The loop from coordinates to values, with its arguments."""
        return _kernel(self.spec, self.setting, self.precision)

    def coordinates(self, light_planes: bool, view_planes: bool) -> int:
        """Address of the loop that finds the coordinate; see `coordinate_loop`."""
        kind: tuple[Any, ...] = (self.space, self.form, light_planes, view_planes, self.tail > 0)
        return jit.address(coordinate_loop(*kind, self.precision))
