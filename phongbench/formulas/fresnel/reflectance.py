"""The reflectance of a material: a formula, with the numbers of the three channels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.coordinate_kernels import fill_values, values_kernel
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.spec import ReflectanceFormula
from phongbench.formulas.spec import MAX_COEFFICIENTS, Parameter
from phongbench.support.values import RGB, three

CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class Fresnel:
    """How much of the light a material mirrors, against the cosine of incidence v = V.H, for each channel.

    kind  str              a name in KINDS
    f0    (r, g, b)        reflectance at normal incidence, 0 .. 1: of constant, schlick, schlick-exp2, f82
    f82   (r, g, b)        reflectance (not a tint) at v = 1/7, 0 .. 1: of f82
    n, k  (r, g, b)        complex refractive index n + i k: of conductor, n alone of dielectric
    Whatever the kind does not take is None. Raises InputError or UnknownNameError naming the field.

    v is V.H = sqrt((1 + L.V) / 2) of unit L and V, not N.H, which is 1 at every mirror configuration.
    """

    kind: str
    f0: Sequence[float] | None = None
    f82: Sequence[float] | None = None
    n: Sequence[float] | None = None
    k: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise UnknownNameError("kind", self.kind, KINDS, "kind")
        wanted = {parameter.name: parameter for parameter in self.formula.parameters}
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if field.name in wanted:
                object.__setattr__(self, field.name, self._three(value, wanted[field.name]))
            elif value is not None:
                raise InputError(f"{self.kind} takes no {field.name}", field.name, f"it takes {' and '.join(wanted)}")

    def _three(self, value: Any, parameter: Parameter) -> RGB:
        fix = f"give three numbers, red, green and blue: {parameter.meaning}"
        if value is None:
            raise InputError(f"{self.kind} needs {parameter.name}", parameter.name, fix)
        found = three(value, parameter.name)
        for number in found:
            if not parameter.low <= number <= parameter.high:
                what = f"{number:g} is outside {parameter.low:g} .. {parameter.high:g}"
                raise InputError(what, parameter.name, fix)
        return found

    @property
    def formula(self) -> ReflectanceFormula:
        """The formula of its kind."""
        return KINDS[self.kind]

    def coefficients(self, channel: int) -> dict[str, float]:
        """What the formula's kernel takes for one channel, 0 to 2."""
        given = {parameter.name: getattr(self, parameter.name)[channel] for parameter in self.formula.parameters}
        return dict(self.formula.coefficients(**given))

    def bound(self, channel: int) -> Callable[[Any], Any]:
        """The plain scalar body of one channel: a function of the cosine of incidence, for any kind of number."""
        values = self.coefficients(channel)
        return lambda cosine: self.formula.kernel(cosine, **values)

    def rows(self, precision: Precision) -> Array:
        """The coefficients as loops take them: (3, MAX_COEFFICIENTS) in the precision's carrier, padded with zeros."""
        found = np.zeros((len(CHANNELS), MAX_COEFFICIENTS), precision.carrier)
        for channel, row in enumerate(found):
            values = self.coefficients(channel)
            row[: len(values)] = [precision.constant(values[name]) for name in self.formula.scalars]
        return found

    def loop(self, precision: Precision) -> Any:
        """The compiled loop from cosines to one channel's reflectance, see `coordinate_kernels.values_kernel`."""
        return values_kernel(self.formula, precision)

    def at(self, cosines: Array, precision: Precision = FLOAT64) -> Array:
        """The reflectance of the three channels, (n, 3), at cosines of incidence (n,); in the precision's carrier."""
        given = np.ascontiguousarray(cosines, precision.carrier)
        out, open_, nothing = np.empty((3, len(given)), precision.carrier), np.ones_like(given), given[:1] * 0
        address = jit.address(self.loop(precision))
        for row, coefficients in zip(out, self.rows(precision), strict=True):
            fill_values(address, given, open_, coefficients, nothing, row)
        return np.ascontiguousarray(out.T)
