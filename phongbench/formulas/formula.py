"""Which formula stands for the specular term: one value, one parser, one printer.

It is written NAME[:FORM][:GAMMA][:SLOPE][@RECIPE], e.g. lyon:dot:32:minimax, gaussian:dot, blinn, lyon:cross:8@half.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY, get
from phongbench.formulas.spec import SPACES, Approximation, Setting
from phongbench.support.values import number

Registry = Mapping[str, Approximation]

#: how a recipe is written, and on which pair its formula works
RECIPES = {"pair": "reflect", "half": "half"}
#: the policy of a formula whose slope is a number
GIVEN = "given"
MODELS = ("phong", "blinn-phong")
_EXAMPLE = "write NAME:FORM:GAMMA:SLOPE, e.g. lyon:difference:8 or lyon:dot:32:minimax"


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula without its exponent: what a name, a lambda form, a gamma, a slope and a pair amount to.

    approximation  str           its name in the registry
    lambda_form    str           dot, difference, cross, tan2; none for formulas of the cosine
    gamma          int | None    a power of two, where the formula takes one
    slope          str | float   policy for the slope beta, or beta itself; none where the formula has none
    space          str           the pair it works on: reflect (R, V) or half (N, H)

    `of` and `parse` fill in what is left out and check every name; whether the formula takes an exponent is seen by
    `check`.
    """

    approximation: str = "phong"
    lambda_form: str = "none"
    gamma: int | None = None
    slope: str | float = "none"
    space: str = "reflect"

    @classmethod
    def of(
        cls,
        approximation: str = "phong",
        lambda_form: str | None = None,
        gamma: int | None = None,
        slope: str | float | None = None,
        space: str | None = None,
        *,
        registry: Registry = REGISTRY,
        where: str = "",
    ) -> "Formula":
        """The formula of these parts; None takes the formula's first, and a gamma that it does not take is dropped.

        where  what the names of the fields follow in errors, e.g. "specular."
        Raises UnknownNameError or InputError naming the field: approximation, lambda, gamma, beta or space.
        """
        if approximation not in registry:
            raise UnknownNameError("approximation", approximation, registry, f"{where}approximation")
        spec = registry[approximation]
        form = _one_of(f"lambda form of {spec.name}", lambda_form, spec.lambda_forms, f"{where}lambda")
        if spec.uses_gamma:
            spec.check_gamma(gamma, f"{where}gamma")
        if slope is None or isinstance(slope, str):
            slope = _one_of(f"beta policy of {spec.name}", slope, spec.slopes, f"{where}beta")
        else:
            slope = number(slope, f"{where}beta")
            _check_slope(spec, f"{where}beta")
        space = _one_of(f"space of {spec.name}", space, spec.spaces, f"{where}space")
        return cls(spec.name, form, int(gamma) if spec.uses_gamma and gamma is not None else None, slope, space)

    @classmethod
    def parse(cls, text: str, registry: Registry = REGISTRY) -> "Formula":
        """The formula of a spelling, e.g. "lyon:dot:32:minimax"; UnknownNameError or InputError says what is wrong."""
        head, at, recipe = text.partition("@")
        name, *parts = head.split(":")
        spec = get(name, registry)
        form = gamma = slope = None
        if parts and (len(spec.lambda_forms) > 1 or parts[0] in (*LAMBDA_FORMS, "none", "")):
            form = parts.pop(0) or None
        if parts and spec.uses_gamma:
            gamma = _gamma(parts.pop(0))
        if parts:
            slope = _slope(parts.pop(0))
        if parts:
            raise InputError(f"there are more parts than {name} takes", None, _EXAMPLE)
        if at and recipe not in RECIPES:
            raise UnknownNameError("recipe", recipe, RECIPES)
        return cls.of(name, form, gamma, slope, RECIPES.get(recipe), registry=registry)

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> "Formula":
        """The formula of a row of a table: columns approximation, lambda_form, gamma, beta_policy and space."""
        gamma = row["gamma"]
        parts = (str(row[name]) for name in ("beta_policy", "space"))
        return cls(str(row["approximation"]), str(row["lambda_form"]), None if pd.isna(gamma) else int(gamma), *parts)

    def spelled(self, registry: Registry = REGISTRY) -> str:
        """The formula as `parse` reads it: form where there are several, gamma if any, slope and pair if not the first.

        Of a formula that the registry does not hold, as of a user's own in a stored run, all that is known.
        """
        spec = registry.get(self.approximation)
        forms, slopes, spaces = (spec.lambda_forms, spec.slopes, spec.spaces) if spec else ((), ("taylor",), SPACES)
        parts = [self.approximation]
        if len(forms) > 1 or (not forms and self.lambda_form != "none"):
            parts.append(self.lambda_form)
        if self.gamma is not None:
            parts.append(str(self.gamma))
        if self.slope not in ("none", slopes[0]):
            parts.append(self.slope if isinstance(self.slope, str) else repr(self.slope))
        recipe = "" if self.space == spaces[0] else "@" + next(r for r, space in RECIPES.items() if space == self.space)
        return ":".join(parts) + recipe

    def __str__(self) -> str:
        return self.spelled()

    def spec(self, registry: Registry = REGISTRY) -> Approximation:
        """Its entry in the registry; where the slope is a number, with that slope. UnknownNameError if it has none."""
        spec = get(self.approximation, registry)
        return spec if isinstance(self.slope, str) else with_slope(spec, self.slope)

    def setting(self, alpha: float) -> Setting:
        """What its coefficients are made for at this exponent."""
        return Setting(alpha, self.gamma, self.slope if isinstance(self.slope, str) else GIVEN, self.space)

    def check(self, alpha: float, registry: Registry = REGISTRY) -> None:
        """Raise InputError, naming the value and its range, unless the formula takes this exponent."""
        self.spec(registry).check(self.setting(alpha))


def with_slope(spec: Approximation, beta: float) -> Approximation:
    """The formula with this slope instead of a policy's; where its support ends is then not known."""
    _check_slope(spec, "beta")

    def coefficients(setting: Setting) -> Mapping[str, float]:
        return {**spec.coefficients(replace(setting, slope=spec.slopes[0])), "beta": beta}

    return replace(spec, coefficients=coefficients, cutoff=None, slopes=(GIVEN,))


def _check_slope(spec: Approximation, where: str) -> None:
    if "beta" not in spec.scalars:
        raise InputError(f"{spec.name} has no slope beta", where, "leave it out")


def _one_of(kind: str, name: str | None, known: tuple[str, ...], where: str) -> str:
    if name is not None and name not in known:
        raise UnknownNameError(kind, name, known, where)
    return known[0] if name is None else name


def _gamma(text: str) -> int:
    if not re.fullmatch("[0-9]{1,6}", text):
        raise InputError("gamma is not a whole number below a million", None, _EXAMPLE)
    return int(text)


def _slope(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text
