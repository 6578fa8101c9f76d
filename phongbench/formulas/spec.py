"""What an approximation is: frozen data that sweep, timing, command line, service, report and tests all read."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import Body, known_arguments
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.citations import Source
from phongbench.formulas.lambda_forms import LAMBDA_FORMS

Kind = Literal["exact", "approximation", "alternative"]
Coordinate = Literal["cosine", "cosine_deficit"]

ALL_FORMS = tuple(LAMBDA_FORMS)
SPACES = ("reflect", "half")
#: how many scalar coefficients a compiled kernel may take
MAX_COEFFICIENTS = 4


@dataclass(frozen=True, slots=True)
class Parameter:
    """One quantity a user chooses: its name, meaning, unit and closed range."""

    name: str
    meaning: str
    low: float
    high: float
    unit: str = "1"
    whole: bool = False


ALPHA = Parameter("alpha", "shininess: the exponent of exact Phong", 1e-3, 1e5)
GAMMA = Parameter("gamma", "exponent of the approximation, a power of two evaluated by squarings", 1, 256, whole=True)


@dataclass(frozen=True, slots=True)
class Setting:
    """The point of the parameter space that coefficients are made for.

    alpha  float > 0    exponent of the exact Phong that is approximated
    gamma  int | None   the approximation's own exponent, a power of two; None where it has none
    slope  str          policy that chooses the slope beta: "taylor", "minimax", "energy", ... or "none"
    space  str          "reflect" (R, V) or "half" (N, H)
    """

    alpha: float
    gamma: int | None = None
    slope: str = "none"
    space: str = "reflect"

    @property
    def n(self) -> int:
        """The number of squarings that make gamma."""
        if self.gamma is None:
            raise InputError("this approximation needs a gamma", None, "give gamma as a power of two, e.g. 8")
        return int(self.gamma).bit_length() - 1

    @property
    def exponent(self) -> float:
        """The exponent to approximate in this space.

        Alpha, or 4 alpha for (N, H), whose angle is half as wide (FISHER_WOO_1994).
        """
        return 4 * self.alpha if self.space == "half" else self.alpha


@dataclass(frozen=True, slots=True)
class Cost:
    """What one evaluation takes beyond its coordinate (cosine or lambda).

    A function of the setting where it depends on it.
    """

    text: str
    multiplies: int | None = None
    lookups: int = 0
    divisions: int = 0
    transcendentals: int = 0


def _anything(setting: Setting) -> bool:
    return True


@dataclass(frozen=True)
class Approximation:
    """One formula for the specular term: its scalar kernel, how its coefficients are made, and what is known about it.

    name          identifier in plans, files, URLs: lower case with hyphens
    title         for people
    kind          "exact", "approximation" of Phong, or "alternative" shape
    formula       in the words of maths: x = a.b, lambda = 1 - x
    source        where it comes from
    kernel        the scalar body: first argument `cosine` or `cosine_deficit`, then coefficients by name; `int`
                  arguments are known when compiling, an argument named `table` is a one-dimensional table
    coefficients  Setting -> {argument: value} for all arguments but the first and `table`
    domain        where it is meant to be used, and what goes wrong outside
    cost          work of one evaluation
    parameters    what the user chooses, with ranges
    lambda_forms  forms it may be measured with; ("none",) for kernels of the cosine
    spaces        "reflect", "half" or both
    slopes        policies for beta; the first is the default; ("none",) if it has none
    accepts       Setting -> bool: False for settings that make no sense (a fractional exponent for squarings)
    cutoff        Setting -> lambda beyond which the kernel is exactly 0, or None where it never is
    table         Setting -> float64 table for the kernel's `table`, or None
    at_zero       Setting -> None if at alpha 0 it is a constant wherever a.b > 0, as Phong is, else why it is not; None
                  if alpha 0 is merely out of range
    also          where the same formula stands under another name
    peak          the value where both directions are the same; 1 but for formulas that miss the peak
    exponent      the kernel's argument that is an exponent of the cosine, where the formula is such a power and takes
                  any exponent: it may then be given the cosine's square and half of it
    falls         True if the value never grows away from the peak, but for rounding: what lies between two
                  coordinates is then bounded by the values there
    """

    name: str
    title: str
    kind: Kind
    formula: str
    source: Source
    kernel: Body
    coefficients: Callable[[Setting], Mapping[str, float]]
    domain: str
    cost: Cost
    parameters: tuple[Parameter, ...] = (ALPHA,)
    lambda_forms: tuple[str, ...] = ALL_FORMS
    spaces: tuple[str, ...] = ("reflect",)
    slopes: tuple[str, ...] = ("none",)
    accepts: Callable[[Setting], bool] = _anything
    cutoff: Callable[[Setting], float] | None = None
    table: Callable[[Setting], NDArray[np.float64]] | None = None
    at_zero: Callable[[Setting], str | None] | None = None
    also: tuple[Source, ...] = ()
    peak: float = 1.0
    exponent: str = ""
    falls: bool = False
    arguments: tuple[str, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        names = tuple(inspect.signature(self.kernel).parameters)
        if not names or names[0] not in ("cosine", "cosine_deficit"):
            raise InputError(
                f"the kernel of {self.name!r} must take cosine or cosine_deficit first, not {names[:1]}",
                self.kernel.__name__,
            )
        object.__setattr__(self, "arguments", names[1:])
        if (self.lambda_forms == ("none",)) != (self.coordinate == "cosine"):
            raise InputError(f"{self.name!r}: a kernel of the cosine has lambda_forms ('none',), others have others")
        for form in self.lambda_forms:
            if form != "none" and form not in LAMBDA_FORMS:
                raise UnknownNameError("lambda form", form, LAMBDA_FORMS)
        if len(self.scalars) > MAX_COEFFICIENTS:
            raise InputError(f"{self.name!r}: a kernel takes at most {MAX_COEFFICIENTS} coefficients")

    @property
    def coordinate(self) -> Coordinate:
        """What the kernel takes first."""
        return "cosine" if next(iter(inspect.signature(self.kernel).parameters)) == "cosine" else "cosine_deficit"

    @property
    def uses_gamma(self) -> bool:
        """True if gamma is one of the parameters."""
        return any(p.name == "gamma" for p in self.parameters)

    @property
    def scalars(self) -> tuple[str, ...]:
        """The kernel's arguments that are numbers given at run time."""
        return tuple(a for a in self.arguments if a not in self.knowns and a != "table")

    @property
    def knowns(self) -> tuple[str, ...]:
        """The kernel's arguments that are known when compiling."""
        return known_arguments(self.kernel)

    def check(self, setting: Setting) -> None:
        """Raise InputError, naming the value and its range, unless the setting is one this approximation can take."""
        for p in self.parameters:
            if p.name == "gamma":
                self.check_gamma(setting.gamma, self.name)
            elif p.name == "alpha" and setting.alpha == 0 and self.at_zero is not None:
                self._check_zero(self.at_zero(setting))
            else:
                self._check_range(p, getattr(setting, p.name, None), self.name)
        if setting.slope not in self.slopes:
            raise UnknownNameError("beta policy", setting.slope, self.slopes, self.name)
        if setting.space not in self.spaces:
            raise UnknownNameError("space", setting.space, self.spaces, self.name)
        if not self.accepts(setting):
            gamma = "" if setting.gamma is None else f", gamma = {setting.gamma}"
            raise InputError(f"{self.name} does not take alpha = {setting.alpha:g}{gamma}", None, self.domain)

    def check_gamma(self, gamma: int | None, where: str) -> None:
        """Raise InputError at this place unless gamma is a power of two in this approximation's range."""
        p = next(p for p in self.parameters if p.name == "gamma")
        self._check_range(p, gamma, where)
        if gamma is not None and gamma & (gamma - 1):
            raise InputError(f"gamma = {gamma} is not a power of two", where, "use 1, 2, 4, 8, 16, ...")

    def _check_zero(self, reason: str | None) -> None:
        """Raise InputError if there is a reason why alpha 0 is not taken."""
        if reason is not None:
            fix = "at alpha 0 Phong is 1 wherever the light is in front, and the formula phong gives that"
            raise InputError(f"{self.name} does not take alpha = 0: {reason}", None, fix)

    def _check_range(self, p: Parameter, value: float | None, where: str) -> None:
        if value is None:
            raise InputError(f"{self.name} needs a {p.name}", where, f"{p.name} is {p.meaning}")
        if not math.isfinite(value) or not p.low <= value <= p.high:
            raise InputError(
                f"{p.name} = {value} is outside {p.low:g} .. {p.high:g}", where, f"{p.name} is {p.meaning}"
            )

    def bound(self, setting: Setting) -> Callable[[Any], Any]:
        """The plain scalar body with this setting's coefficients.

        A function of the coordinate, for any kind of number.
        """
        values: dict[str, Any] = dict(self.coefficients(setting))
        if self.table is not None:
            values["table"] = self.table(setting)
        return lambda coordinate: self.kernel(coordinate, **values)
