"""What is lit, by what, and who looks: the frozen, checked arguments of shading.py."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from phongbench import materials
from phongbench.approximations import REGISTRY, get, guarded
from phongbench.errors import InputError, UnknownNameError
from phongbench.spec import Approximation, Setting

Vector3 = tuple[float, float, float]
RGB = tuple[float, float, float]

MODELS = ("phong", "blinn-phong")
BLACK: RGB = (0.0, 0.0, 0.0)
WHITE: RGB = (1.0, 1.0, 1.0)
CONSTANT = (1.0, 0.0, 0.0)


def three(value: Any, where: str) -> Vector3:
    """Three finite numbers; InputError naming the field otherwise."""
    try:
        x, y, z = value
        found = (float(x), float(y), float(z))
    except (TypeError, ValueError, OverflowError):
        raise InputError("not three numbers", where, "give [x, y, z]") from None
    if isinstance(value, str) or not all(map(math.isfinite, found)):
        raise InputError("not three finite numbers", where, "give [x, y, z]")
    return found


def colour(value: Any, where: str) -> RGB:
    """Three finite numbers >= 0, red, green and blue; they may exceed 1."""
    found = three(value, where)
    if min(found) < 0:
        raise InputError("a colour cannot be negative", where, "give three numbers from 0 up")
    return found


def number(value: Any, where: str, low: float = 0.0) -> float:
    """One finite number of at least `low`."""
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not a number", where) from None
    if isinstance(value, str) or not math.isfinite(found) or found < low:
        raise InputError(f"not a finite number of at least {low:g}", where)
    return found


def direction(value: Any, where: str) -> Vector3:
    """Three finite numbers, not all 0; the length does not matter, here it becomes 1."""
    found = three(value, where)
    largest = max(map(abs, found))
    if largest == 0:
        raise InputError("a direction cannot be 0", where, "give the vector from the surface towards it")
    x, y, z = (v / largest for v in found)  # neither overflows nor vanishes when squared
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


def _one_of_two(thing: Any) -> None:
    """Check that a light or viewer is either far away, in a direction, or at a position."""
    if (thing.direction is None) == (thing.position is None):
        both = "both" if thing.direction is not None else "neither"
        raise InputError(f"{both} of direction and position", "direction", "give one: far away, or at a place")
    for name, made in (("direction", direction), ("position", three)):
        value = getattr(thing, name)
        if value is not None:
            object.__setattr__(thing, name, made(value, name))


@dataclass(frozen=True)
class Light:
    """A light: far away in a direction, or at a position.

    direction    (x, y, z) | None  from the surface towards the light; any length but 0, kept as a unit vector
    position     (x, y, z) | None  where it is; one of the two is given
    attenuation  (c, l, q)         of a light at a position: its light counts 1 / (c + l d + q d^2) at distance d; each
                                   >= 0, not all 0
    diffuse      (r, g, b) >= 0    id: the colour, intensity included, of its diffuse term
    specular     (r, g, b) >= 0    is: that of its specular term
    reach        float | None      of a light at a position: it is left out beyond this distance, which changes a colour
                                   by at most (kd id + ks is * largest specular value) / (c + l reach + q reach^2)
    Raises InputError naming the field.
    """

    direction: Sequence[float] | None = None
    position: Sequence[float] | None = None
    attenuation: Sequence[float] = CONSTANT
    diffuse: Sequence[float] = WHITE
    specular: Sequence[float] = WHITE
    reach: float | None = None

    def __post_init__(self) -> None:
        _one_of_two(self)
        attenuation = three(self.attenuation, "attenuation")
        if min(attenuation) < 0 or max(attenuation) == 0:
            raise InputError("attenuation needs c, l, q >= 0, not all 0", "attenuation", "[1, 0, 0] is none")
        if self.position is None and (attenuation != CONSTANT or self.reach is not None):
            field = "reach" if self.reach is not None else "attenuation"
            raise InputError(f"a light in a direction is infinitely far away and has no {field}", field)
        if self.reach is not None:
            object.__setattr__(self, "reach", number(self.reach, "reach"))
        object.__setattr__(self, "attenuation", attenuation)
        for name in ("diffuse", "specular"):
            object.__setattr__(self, name, colour(getattr(self, name), name))


@dataclass(frozen=True)
class Viewer:
    """Who looks: from a position, or from far away.

    direction  (x, y, z) | None  from the surface towards the viewer; any length but 0, kept as a unit vector
    position   (x, y, z) | None  where the eye is; one of the two is given
    """

    position: Sequence[float] | None = None
    direction: Sequence[float] | None = None

    def __post_init__(self) -> None:
        _one_of_two(self)


@dataclass(frozen=True)
class Material:
    """What a surface does to light: ka, kd and ks, each three numbers >= 0, and alpha >= 0.

    A shininess below what the specular term's formula takes is refused where that term is not 0 anyway.
    """

    ambient: Sequence[float] = BLACK
    diffuse: Sequence[float] = BLACK
    specular: Sequence[float] = BLACK
    shininess: float = 1.0

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            object.__setattr__(self, name, colour(getattr(self, name), name))
        object.__setattr__(self, "shininess", number(self.shininess, "shininess"))

    @property
    def highlight_exponent(self) -> float:
        """The shininess, or 1 where there is no highlight: then it does not matter, and any number will do."""
        return self.shininess if max(self.specular) > 0 else 1.0

    @classmethod
    def of(cls, named: materials.Material) -> "Material":
        """One of materials.py, where a shininess of 0 means no highlight."""
        specular = named.specular if named.shininess > 0 else BLACK
        return cls(named.ambient, named.diffuse, specular, named.shininess)


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


@dataclass(frozen=True)
class Skips:
    """What may be left out, one switch each.

    Exact, the colours are the same bits: `lights_behind` a light that no point of a tile or block faces;
    `zero_colours` a term whose colour product is 0; `beyond_support` the formula, where a block lies beyond the end of
    its support; `unused_vectors` V, R and H where no specular term asks for them; `constant_directions` the repetition
    of a direction that is the same everywhere.
    Bounded: `reach` a light beyond its own reach (see Light); `dark_tail` exact Phong where it is below `tail`, which
    changes a colour by at most tail * ks * is * attenuation for each light.
    tail  float | None  None: 4 roundings at 1, about 5e-7 in float32 and 9e-16 in float64
    """

    lights_behind: bool = True
    zero_colours: bool = True
    beyond_support: bool = True
    unused_vectors: bool = True
    constant_directions: bool = True
    reach: bool = True
    dark_tail: bool = True
    tail: float | None = None

    def __post_init__(self) -> None:
        if self.tail is not None and number(self.tail, "tail") >= 1:
            raise InputError("a tail of 1 or more is no tail", "tail", "give a specular value that counts as dark")

    @classmethod
    def none(cls) -> "Skips":
        """Nothing is left out."""
        return cls(**{f.name: False for f in fields(cls) if f.name != "tail"})

    @classmethod
    def exact(cls) -> "Skips":
        """Only what changes no bit."""
        return cls(reach=False, dark_tail=False)
