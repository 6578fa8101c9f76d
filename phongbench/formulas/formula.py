"""Which formula stands for the specular term: one value, one parser, one printer.

It is written NAME[:FORM][:GAMMA][:SLOPE][@RECIPE][/NORMALISE], e.g. lyon:dot:32:minimax, gaussian:dot, blinn,
lyon:cross:8@half, phong/each, lyon:cross:8@lengthwise/once.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, RECIPES
from phongbench.formulas.registry import REGISTRY, get
from phongbench.formulas.spec import SPACES, Approximation, Setting
from phongbench.support.values import number

Registry = Mapping[str, Approximation]

#: what stands after the @: the space of the pair, and how it is made
_AFTER_AT = {"pair": ("reflect", PAIR), "half": ("half", PAIR)} | {
    name: (recipe.space, name) for name, recipe in RECIPES.items()
}
#: the policy of a formula whose slope is a number
GIVEN = "given"
MODELS = ("phong", "blinn-phong")
_EXAMPLE = "write NAME:FORM:GAMMA:SLOPE, e.g. lyon:difference:8 or lyon:dot:32:minimax"


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula without its exponent: what a name, a lambda form, a gamma, a slope, a pair and its lengths amount to.

    approximation  str           its name in the registry
    lambda_form    str           dot, difference, cross, tan2; none for formulas of the cosine
    gamma          int | None    a power of two, where the formula takes one
    slope          str | float   policy for the slope beta, or beta itself; none where the formula has none
    space          str           the pair it works on: reflect (R, V) or half (N, H)
    recipe         str           how the pair is made from N, L and V: reflect, lengthwise, halfway; pair if it is given
    normalise      str           how wrong lengths are removed: none, each, once, squared, fast, estimate

    `of` and `parse` fill in what is left out and check every name; whether the formula takes an exponent is seen by
    `check`.
    """

    approximation: str = "phong"
    lambda_form: str = "none"
    gamma: int | None = None
    slope: str | float = "none"
    space: str = "reflect"
    recipe: str = PAIR
    normalise: str = "none"

    @classmethod
    def of(
        cls,
        approximation: str = "phong",
        lambda_form: str | None = None,
        gamma: int | None = None,
        slope: str | float | None = None,
        space: str | None = None,
        *,
        recipe: str | None = None,
        normalise: str | None = None,
        registry: Registry = REGISTRY,
        where: str = "",
    ) -> "Formula":
        """The formula of these parts; None takes the formula's first, and a gamma that it does not take is dropped.

        where  what the names of the fields follow in errors, e.g. "specular."
        Raises UnknownNameError or InputError naming the field: approximation, lambda, gamma, beta, space, recipe or
        normalise.
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
        recipe = _one_of("recipe", recipe, (PAIR, *RECIPES), f"{where}recipe")
        if recipe != PAIR:
            space = _made_space(spec, recipe, space, where)
        space = _one_of(f"space of {spec.name}", space, spec.spaces, f"{where}space")
        normalise = _one_of("normalise", normalise, tuple(NORMALISE), f"{where}normalise")
        _check_normalise(spec, form, normalise, f"{where}normalise")
        whole = int(gamma) if spec.uses_gamma and gamma is not None else None
        return cls(spec.name, form, whole, slope, space, recipe, normalise)

    @classmethod
    def parse(cls, text: str, registry: Registry = REGISTRY) -> "Formula":
        """The formula of a spelling, e.g. "lyon:dot:32:minimax"; UnknownNameError or InputError says what is wrong."""
        head, slash, normalise = text.partition("/")
        head, at, recipe = head.partition("@")
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
        if at and recipe not in _AFTER_AT:
            raise UnknownNameError("recipe", recipe, _AFTER_AT)
        if slash and normalise not in NORMALISE:
            raise UnknownNameError("way to normalise", normalise, NORMALISE)
        space, made = _AFTER_AT.get(recipe, (None, PAIR))
        return cls.of(name, form, gamma, slope, space, recipe=made, normalise=normalise or None, registry=registry)

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> "Formula":
        """The formula of a row of a table: columns approximation, lambda_form, gamma, beta_policy and space, and recipe
        and normalise where there are such.
        """
        gamma = row["gamma"]
        slope, space = str(row["beta_policy"]), str(row["space"])
        raw = {name: str(row[name]) for name in ("recipe", "normalise") if name in row}
        known = isinstance(gamma, Real) and gamma == gamma  # None, NaN and pandas' NA are none
        whole = int(row["gamma"]) if known else None
        return cls(str(row["approximation"]), str(row["lambda_form"]), whole, slope, space, **raw)

    def spelled(self, registry: Registry = REGISTRY) -> str:
        """The formula as `parse` reads it: form where there are several, gamma if any, the rest where not the first.

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
        pair = (self.space, self.recipe)
        recipe = "" if pair == (spaces[0], PAIR) else "@" + next(at for at, made in _AFTER_AT.items() if made == pair)
        return ":".join(parts) + recipe + ("" if self.normalise == "none" else f"/{self.normalise}")

    def __str__(self) -> str:
        return self.spelled()

    def spec(self, registry: Registry = REGISTRY) -> Approximation:
        """Its entry in the registry, with the slope where that is a number, with half the power's exponent where the
        cosine is taken squared. UnknownNameError if there is none.
        """
        spec = get(self.approximation, registry)
        if self.normalise == "squared":
            spec = of_square(spec)
        return spec if isinstance(self.slope, str) else with_slope(spec, self.slope)

    @property
    def raw(self) -> bool:
        """True if it makes its pair, or removes lengths: then its value is no function of the pair's angle alone."""
        return self.recipe != PAIR or self.normalise != "none"

    def setting(self, alpha: float) -> Setting:
        """What its coefficients are made for at this exponent."""
        return Setting(alpha, self.gamma, self.slope if isinstance(self.slope, str) else GIVEN, self.space)

    def normalises_in(self, precision: str) -> bool:
        """True if its way to remove lengths makes sense in a precision: tricks with bits are float32's."""
        return precision in (NORMALISE[self.normalise].precisions or (precision,))

    def check_pair(self, where: str | None = None) -> None:
        """Raise InputError unless the formula takes its two directions as arguments."""
        if self.recipe != PAIR:
            plain = str(replace(self, recipe=PAIR))
            fix = f"give the formula of the pair, {plain}, or use `phongbench recommend --raw` and `phongbench shader`"
            raise InputError(f"{self} starts from N, L and V, and here are two directions", where, fix)

    def check(self, alpha: float, registry: Registry = REGISTRY) -> None:
        """Raise InputError, naming the value and its range, unless the formula takes this exponent."""
        self.spec(registry).check(self.setting(alpha))


def with_slope(spec: Approximation, beta: float) -> Approximation:
    """The formula with this slope instead of a policy's; where its support ends is then not known."""
    _check_slope(spec, "beta")

    def coefficients(setting: Setting) -> Mapping[str, float]:
        return {**spec.coefficients(replace(setting, slope=spec.slopes[0])), "beta": beta}

    return replace(spec, coefficients=coefficients, cutoff=None, slopes=(GIVEN,))


def of_square(spec: Approximation) -> Approximation:
    """A power of the cosine as the power of its square, with half the exponent."""

    def coefficients(setting: Setting) -> Mapping[str, float]:
        values = spec.coefficients(setting)
        return {**values, spec.exponent: values[spec.exponent] / 2}

    return replace(spec, coefficients=coefficients)


def takes(spec: Approximation, form: str, normalise: str) -> bool:
    """True if lengths can be removed in this way for this formula and lambda form.

    The form tan2 is free of lengths already; squares are for powers of the cosine; and the pair can be treated as a
    whole only in some forms.
    """
    way = NORMALISE[normalise]
    if normalise == "none":
        return True
    if normalise == "squared" and not spec.exponent:
        return False
    return form in dict(way.forms) if way.forms else form != "tan2"


def normalises(spec: Approximation) -> dict[str, list[str]]:
    """Lambda form -> the ways of removing lengths that the formula takes in it."""
    return {form: [way for way in NORMALISE if takes(spec, form, way)] for form in spec.lambda_forms}


def _made_space(spec: Approximation, recipe: str, space: str | None, where: str) -> str:
    """The space of the pair that a recipe makes, which must be the formula's."""
    made = RECIPES[recipe].space
    if made not in spec.spaces or space not in (None, made):
        fitting = [name for name, known in RECIPES.items() if known.space in spec.spaces]
        pair = {"reflect": "(R, V)", "half": "(N, H)"}[made]
        raise InputError(f"{recipe} makes {pair}, which {spec.name} does not take", f"{where}recipe", f"use {fitting}")
    return made


def _check_normalise(spec: Approximation, form: str, normalise: str, where: str) -> None:
    if not takes(spec, form, normalise):
        ways = ", ".join(name for name in NORMALISE if takes(spec, form, name))
        named = spec.name if form == "none" else f"{spec.name}:{form}"
        raise InputError(f"{named} does not take normalise = {normalise}", where, f"it takes {ways}")


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
