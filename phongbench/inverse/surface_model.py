"""What a pixel's intensity is made of: lights far away, the terms' strengths, and the formula of the highlight."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from phongbench.compiler.precisions import FLOAT64, Array
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.registry import REGISTRY, guarded
from phongbench.shading.specular_term import EXACT
from phongbench.support.values import direction, number


@dataclass(frozen=True)
class PhotometricLight:
    """A light far away: the direction towards it, made unit, z >= 0; and its intensity, a factor of both terms."""

    direction: tuple[float, float, float]
    intensity: float = 1.0

    @classmethod
    def of(cls, towards: Any, intensity: Any = 1.0, where: str = "lights") -> "PhotometricLight":
        """A light of these values; InputError naming the place."""
        found, strength = direction(towards, where), number(intensity, where)
        if found[2] < 0:
            raise InputError("the light comes from behind: z is negative", where, "z points to the viewer")
        if strength == 0:
            raise InputError("a light of intensity 0 tells nothing", where, "leave it out, and its picture")
        return cls(found, strength)


@dataclass(frozen=True)
class SurfaceModel:
    """What a pixel's intensity is made of: the terms' strengths, and the formula of the highlight at an exponent.

    ambient, diffuse, specular  >= 0, diffuse > 0; strengths for lights of intensity 1
    alpha                       exponent of exact Phong
    formula                     Phong's own power, or what stands for it
    """

    ambient: float = 0.0
    diffuse: float = 1.0
    specular: float = 0.0
    alpha: float = 50.0
    formula: Formula = EXACT
    registry: Registry = field(default_factory=lambda: REGISTRY)

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular", "alpha"):
            object.__setattr__(self, name, number(getattr(self, name), name))
        if self.diffuse == 0:
            raise InputError("without a diffuse term the start is unknown", "diffuse", "give a number above 0")
        if self.formula.raw:
            fix = f"give {self.formula.approximation} without @ and /: normals and lights are unit vectors here"
            raise InputError(f"{self.formula} makes its pair or removes lengths", "specular", fix)
        self.formula.check(self.alpha, self.registry)

    def kernel(self) -> Kernel:
        """The formula compiled, from coordinates to values in float64."""
        spec = self.formula.spec(self.registry)
        with guarded(spec):
            return Kernel.of(spec, self.formula.setting(self.alpha), FLOAT64)


def solver_rows(lights: Sequence[PhotometricLight]) -> Array:
    """The lights as the solver takes them: direction, half vector towards the viewer, intensity."""
    towards = np.array([light.direction for light in lights])
    half = towards + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1)[:, None]
    return np.column_stack([towards, half, [light.intensity for light in lights]])
