"""Which formula stands for the specular term: its name, lambda form, gamma and slope, resolved and named."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.registry import REGISTRY, get, guarded
from phongbench.formulas.spec import Approximation, Setting
from phongbench.support.values import number

MODELS = ("phong", "blinn-phong")


def specular_of(text: str) -> "Specular":
    """A formula written as NAME, NAME:FORM or NAME:FORM:GAMMA, e.g. lyon:difference:8.

    Raises InputError for more than that; whether it fits a material's shininess is seen when it is shaded.
    """
    name, *rest = text.split(":")
    if len(rest) > 2:
        raise InputError(
            "a formula has no more than three parts", None, "write NAME:FORM:GAMMA, e.g. lyon:difference:8"
        )
    form, gamma = (*rest, None, None)[:2]
    if gamma is not None and not re.fullmatch("[0-9]{1,6}", gamma):
        raise InputError("gamma is not a whole number below a million", None, "write e.g. lyon:difference:8")
    return Specular(name, form or None, None if gamma is None else int(gamma))


def cell_name(cell: Mapping[str, Any]) -> str:
    """A cell's name for people: "lyon, cross, gamma 8, minimax"; Taylor slopes and reflect space go without saying."""
    form = [cell["lambda_form"]] if cell["lambda_form"] != "none" else []
    gamma = [] if pd.isna(cell["gamma"]) else [f"gamma {int(cell['gamma'])}"]
    policy = [cell["beta_policy"]] if cell["beta_policy"] not in ("none", "taylor") else []
    half = ["half space"] if cell["space"] == "half" else []
    return ", ".join([str(cell["approximation"]), *form, *gamma, *policy, *half])


@dataclass(frozen=True)
class Specular:
    """Which formula stands for the specular term.

    approximation  str                 its name in the registry
    lambda_form    str | None          "dot", "difference", "cross", "tan2"; None takes the formula's first
    gamma          int | None          a power of two, for formulas that have one
    beta           str | float | None  a policy, or the slope itself; None takes the formula's first policy
    """

    approximation: str = "phong"
    lambda_form: str | None = None
    gamma: int | None = None
    beta: str | float | None = None

    def resolved(
        self, model: str, shininess: float, registry: Any = REGISTRY
    ) -> tuple[Approximation, str, Setting, str]:
        """(formula, lambda form, setting, space): what to evaluate, and on which pair, (R, V) or (N, H).

        Model "phong" takes (R, V), or (N, H) for the formulas that exist there only. Model "blinn-phong" raises N.H to
        the material's shininess itself; a formula stands for that power as it does for Phong's.
        Raises UnknownNameError or InputError naming the field.
        """
        if model not in MODELS:
            raise UnknownNameError("model", model, MODELS, "model")
        spec = _within("specular.approximation", lambda: get(self.approximation, registry))
        if model == "blinn-phong" and "reflect" not in spec.spaces:
            mend = f'take model "phong" for {spec.name}, or "phong" for N.H to the shininess itself'
            raise InputError(f"{spec.name} is a formula of N.H already", "specular.approximation", mend)
        form = self.lambda_form or spec.lambda_forms[0]
        if form not in spec.lambda_forms:
            raise UnknownNameError(f"lambda form of {spec.name}", form, spec.lambda_forms, "specular.lambda")
        if isinstance(self.beta, float | int):
            spec = with_slope(spec, number(self.beta, "specular.beta"))
        slope = self.beta if isinstance(self.beta, str) else spec.slopes[0]
        if slope not in spec.slopes:
            raise UnknownNameError(f"beta policy of {spec.name}", slope, spec.slopes, "specular.beta")
        setting = Setting(shininess, self.gamma, slope, spec.spaces[0])
        field = "specular.gamma" if spec.uses_gamma and _alpha_fits(spec, shininess) else "material.shininess"
        with guarded(spec):
            _within(field, lambda: spec.check(setting))
        return spec, form, setting, "half" if model == "blinn-phong" or setting.space == "half" else "reflect"


def _alpha_fits(spec: Approximation, alpha: float) -> bool:
    return all(p.low <= alpha <= p.high for p in spec.parameters if p.name == "alpha")


def _within(where: str, call: Any) -> Any:
    """What the call returns; its InputError gets this place."""
    try:
        return call()
    except InputError as problem:
        problem.where = where
        raise


def with_slope(spec: Approximation, beta: float) -> Approximation:
    """The formula with this slope instead of a policy's; where its support ends is then not known."""
    if "beta" not in spec.scalars:
        raise InputError(f"{spec.name} has no slope beta", "specular.beta", "leave it out")
    return replace(spec, coefficients=lambda s: {**spec.coefficients(s), "beta": beta}, cutoff=None)
