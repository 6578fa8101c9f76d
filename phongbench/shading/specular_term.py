"""The specular term: which formula stands for it, on which pair of vectors it is evaluated, and where it is dark."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import MODELS, Formula, Registry
from phongbench.formulas.kernel import Kernel, limit
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY, guarded
from phongbench.formulas.spec import Approximation, Setting
from phongbench.shading.light_loops import coordinate_loop
from phongbench.shading.lighting import Material, Skips

#: Phong's own power
EXACT = Formula()


def formula_for(formula: Formula, material: Material, model: str = "phong", registry: Registry = REGISTRY) -> Formula:
    """The formula, with what it leaves open filled in, if it can shade this material.

    Raises UnknownNameError or InputError naming the field: model, specular.approximation, specular.lambda,
    specular.gamma, specular.beta, specular.space, specular.recipe, specular.normalise or material.shininess.
    """
    if model not in MODELS:
        raise UnknownNameError("model", model, MODELS, "model")
    parts = (formula.approximation, formula.lambda_form, formula.gamma, formula.slope, formula.space)
    raw: dict[str, Any] = {"recipe": formula.recipe, "normalise": formula.normalise}
    formula = Formula.of(*parts, **raw, registry=registry, where="specular.")
    if model == "blinn-phong" and formula.space == "half":
        fix = f'take model "phong" for {formula}, or "phong" for N.H to the shininess itself'
        raise InputError(f"{formula.approximation} is a formula of N.H already", "specular.approximation", fix)
    if model == "blinn-phong" and formula.recipe != PAIR:
        fix = f'take model "phong", or {replace(formula, recipe=PAIR)}, which is given N and H'
        raise InputError(f'{formula} makes R, and model "blinn-phong" is about H', "specular.recipe", fix)
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

    form       lambda form, "none" for formulas of the cosine
    pair       what it is evaluated on, see `light_loops.coordinate_loop`
    normalise  how it removes the pair's lengths
    dark       the coordinate beyond which a block is left out
    tail       the cosine, or its square, below which exact Phong counts as dark; 0: nowhere
    """

    spec: Approximation
    setting: Setting
    form: str
    pair: str
    normalise: str
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
        check_precision(formula, precision.name)
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
        if formula.normalise == "squared":  # its coordinate is the square of the cosine
            dark, tail = math.copysign(dark * dark, dark), tail * tail
        pair = _pair("half" if model == "blinn-phong" else formula.space, formula)
        return cls(spec, setting, form, pair, formula.normalise, precision, dark, tail)

    @property
    def keeps_view(self) -> bool:
        """True if V need not be made unit: the formula removes its length, and nothing else asks for it."""
        return self.normalise != "none" and self.pair not in ("half", "halfway")

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
        kind: tuple[Any, ...] = (self.pair, self.form, light_planes, view_planes, self.tail > 0)
        return jit.address(coordinate_loop(*kind, self.precision, self.normalise))


def check_precision(formula: Formula, precision: str) -> None:
    """Raise InputError unless the formula's way to remove lengths makes sense in a precision."""
    if not formula.normalises_in(precision):
        fix = f"shade in float32, or take {replace(formula, normalise='each')}"
        raise InputError(f"/{formula.normalise} works on the bits of float32, not {precision}", "specular", fix)


def _pair(space: str, formula: Formula) -> str:
    """What `coordinate_loop` calls the pair: H is not made unit where the formula, or its recipe, does not want it."""
    if space == "half":
        return "half" if formula.recipe == PAIR and formula.normalise == "none" else "halfway"
    return {PAIR: "reflect", "reflect": "unit"}.get(formula.recipe, formula.recipe)
