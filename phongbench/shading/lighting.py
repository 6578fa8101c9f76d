"""What is lit, by what, and who looks: the frozen, checked arguments of shading.py."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from phongbench.errors import InputError
from phongbench.formulas.fresnel.reflectance import Fresnel
from phongbench.inputs import mtl_files
from phongbench.support.values import RGB, colour, direction, number, three

BLACK: RGB = (0.0, 0.0, 0.0)
WHITE: RGB = (1.0, 1.0, 1.0)
CONSTANT = (1.0, 0.0, 0.0)


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
    ambient      (r, g, b) >= 0    ia: what it adds to the ambient light, attenuated as its other terms. It stands for
                                   light that comes by way of other surfaces, as a sum over lights (HYPERGRAPH): so it
                                   reaches points that face away or lie in shadow, too
    reach        float | None      of a light at a position: it is left out beyond this distance, which changes a colour
                                   by at most (ka ia + kd id + ks is * largest specular value) * att(reach)
    Raises InputError naming the field.
    """

    direction: Sequence[float] | None = None
    position: Sequence[float] | None = None
    attenuation: Sequence[float] = CONSTANT
    diffuse: Sequence[float] = WHITE
    specular: Sequence[float] = WHITE
    reach: float | None = None
    ambient: Sequence[float] = BLACK

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
        for name in ("diffuse", "specular", "ambient"):
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

    fresnel  Fresnel | None  how much of ks is mirrored at each incidence: a highlight's colour is ks F(v), v = V.H.
                             None: all of it, the constant ks of Phong's model
    A shininess below what the specular term's formula takes is refused where that term is not 0 anyway.
    """

    ambient: Sequence[float] = BLACK
    diffuse: Sequence[float] = BLACK
    specular: Sequence[float] = BLACK
    shininess: float = 1.0
    fresnel: Fresnel | None = None

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            object.__setattr__(self, name, colour(getattr(self, name), name))
        object.__setattr__(self, "shininess", number(self.shininess, "shininess"))

    @property
    def highlight_exponent(self) -> float:
        """The shininess, or 1 where there is no highlight: then it does not matter, and any number will do."""
        return self.shininess if max(self.specular) > 0 else 1.0

    @classmethod
    def of(cls, named: mtl_files.Material) -> "Material":
        """One of materials.py, where a shininess of 0 means no highlight."""
        specular = named.specular if named.shininess > 0 else BLACK
        return cls(named.ambient, named.diffuse, specular, named.shininess)


@dataclass(frozen=True)
class Skips:
    """What may be left out, one switch each.

    Exact, the colours are the same bits: `lights_behind` a light that no point of a tile or block faces;
    `zero_colours` a term whose colour product is 0; `beyond_support` the formula, where a block lies beyond the end of
    its support; `unused_vectors` V, R and H where no specular term asks for them; `constant_directions` the repetition
    of a direction that is the same everywhere: it is made unit once, when it is read, not once for each point.
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
        return cls(**{f.name: False for f in fields(cls) if f.type is bool})

    @classmethod
    def exact(cls) -> "Skips":
        """Only what changes no bit."""
        return cls(reach=False, dark_tail=False)
