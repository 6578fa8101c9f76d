"""How a line is lit."""

import math
from dataclasses import dataclass
from typing import Any

from phongbench.errors import InputError
from phongbench.support.values import number

#: the largest strength or length, and one over the smallest
_LARGEST = 1e9
#: how far a light's length may be from 1 by rounding
_ROUNDING = 1e-9


@dataclass(frozen=True)
class LineModel:
    """How the line is lit.

    ambient  >= 0     intensity without the light
    diffuse  > 0      what the light adds where it falls straight on, for a light of length 1
    light    (x, z)   towards the light, z >= 0; its length is taken as it is, a factor of `diffuse`
    noise    >= 0     standard deviation of intensities
    """

    ambient: float
    diffuse: float
    light: tuple[float, float]
    noise: float = 0.0

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "noise"):
            value = number(getattr(self, name), name)
            if value > _LARGEST or (name == "diffuse" and value < 1 / _LARGEST):
                least = f"{1 / _LARGEST:g}" if name == "diffuse" else "0"
                raise InputError(f"outside {least} .. {_LARGEST:g}", name, "intensities are 0 .. 1")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "light", _light(self.light))

    @property
    def length(self) -> float:
        """Of the light."""
        return math.hypot(*self.light)

    @property
    def spread(self) -> float:
        """What the noise is of the cosine of the angle to the light: its standard deviation."""
        return self.noise / (self.diffuse * self.length)

    def unit(self) -> "LineModel":
        """The same with a light of length 1."""
        x, z = self.light
        return LineModel(self.ambient, self.diffuse, (x / self.length, z / self.length), self.noise)

    @property
    def notes(self) -> tuple[str, ...]:
        """The light's length, where that is not 1."""
        x, z = self.light
        if abs(self.length - 1) <= _ROUNDING:
            return ()
        told = f"the light [{x:g}, {z:g}] has length {self.length:.6g} and is taken as given; --unit-light makes it 1"
        return (told,)


def _light(given: Any) -> tuple[float, float]:
    try:
        x, z = (float(v) for v in given)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not two numbers", "light", "give [x, z], x to the right and z to the viewer") from None
    if isinstance(given, str) or not 1 / _LARGEST <= math.hypot(x, z) <= _LARGEST:
        raise InputError("no direction of some length", "light", "give [x, z], towards the light, not both 0")
    if z < 0:
        raise InputError("the light comes from behind: z is negative", "light", "z points to the viewer")
    return x, z
