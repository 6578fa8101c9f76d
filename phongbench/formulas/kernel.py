"""A formula compiled at one setting, with all that its loop takes: address, coefficients, table."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import coordinate_kernels, pair_kernels
from phongbench.formulas.pair_kernels import AXIS
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation, Setting

#: a support that ends here ends before 90 degrees, with room for rounding
_SURE = 0.99
#: room for the rounding of a coordinate; a pair this close to the cutoff is not skipped
_ROOM = 1e-5


@dataclass(frozen=True, eq=False)
class Kernel:
    """A compiled loop and its arguments at one setting; `of` and `of_pairs` make it.

    loop          compiled: (coordinate, gate, coefficients, table, out), or (a, b, coefficients, table, out)
    coefficients  (MAX_COEFFICIENTS,)   in the precision's carrier
    table         (entries,)            in the precision's carrier; a single 0 where the formula has none
    """

    loop: Any
    coefficients: Array
    table: Array

    @classmethod
    def of(cls, spec: Approximation, setting: Setting, precision: Precision) -> "Kernel":
        """The loop from coordinates to values, see `coordinate_kernels.values_kernel`.

        The setting is not checked: probes ask what a formula does outside its range.
        """
        loop = coordinate_kernels.values_kernel(spec, precision, known_values(spec, setting))
        return cls(loop, coefficient_row(spec, setting, precision), table_row(spec, setting, precision))

    @classmethod
    def of_pairs(
        cls,
        spec: Approximation,
        form: str,
        setting: Setting,
        precision: Precision,
        layout: str = "soa",
        *,
        normalise: str = "none",
        recipe: str = PAIR,
        uniform: bool = False,
        timed: bool = False,
    ) -> "Kernel":
        """The loop from pairs of vectors to values, see `pair_kernels.pairs_kernel`; gated where that is needed."""
        raw: dict[str, Any] = {"normalise": normalise, "recipe": recipe, "uniform": uniform, "timed": timed}
        known, gated = known_values(spec, setting), needs_gate(spec, form, setting)
        loop = pair_kernels.pairs_kernel(spec, form, precision, known, layout=layout, gated=gated, **raw)
        return cls(loop, coefficient_row(spec, setting, precision), table_row(spec, setting, precision))

    @cached_property
    def address(self) -> int:
        """The loop's address, for drivers."""
        return jit.address(self.loop)

    def values(self, coordinate: Array, gate: Array) -> Array:
        """Values of the loop over coordinates, 0 where the gate is not positive.

        coordinate, gate  (n,) in the precision's carrier, C-contiguous
        """
        out = np.empty_like(coordinate)
        coordinate_kernels.fill_values(self.address, coordinate, gate, self.coefficients, self.table, out)
        return out

    def fill_pairs(self, a: Array, b: Array, out: Array) -> None:
        """Values of the loop over pairs. Nothing is checked: a wrong shape reads what it must not.

        a, b  of the layout's shape, C-contiguous, in the precision's carrier; may be read-only. As many pairs are read
              as `out` is long: they may hold more
        out   (n,) of the same type
        """
        pair_kernels.fill_pairs(self.address, read_only(a), read_only(b), self.coefficients, self.table, out)


def evaluate(spec: Approximation, setting: Setting, coordinate: Array, cosine: Array | None = None) -> Array:
    """Values of the approximation in float64 over an array of its coordinate.

    coordinate  (n,)         what the kernel takes: cosines, or lambdas
    cosine      (n,) | None  of the angle; where it is given and not positive, the value is 0
    returns     (n,) float64
    Raises InputError for a setting that the approximation does not take.
    """
    spec.check(setting)
    coordinate = np.ascontiguousarray(coordinate, dtype=np.float64)
    gate = np.ones_like(coordinate) if cosine is None else np.ascontiguousarray(cosine, dtype=np.float64)
    return Kernel.of(spec, setting, FLOAT64).values(coordinate, gate)


def highlights(
    spec: Approximation,
    form: str,
    setting: Setting,
    a: Array,
    b: Array,
    *,
    precision: Precision = FLOAT32,
    layout: str = "soa",
) -> Array:
    """Highlights of pairs, computed by the timed kernel itself.

    a, b     (3, n) or, for layout "aos", (n, 3)  directions; read-only arrays are welcome, other dtypes are converted
    returns  (n,)                                 in the precision's carrier
    Raises InputError for shapes that are not these, and for a setting that the approximation does not take.
    """
    spec.check(setting)
    a, b = (np.ascontiguousarray(v, dtype=precision.carrier) for v in (a, b))
    if a.shape != b.shape or a.ndim != 2 or a.shape[AXIS[layout]] != 3:
        wanted = {"soa": "(3, n)", "aos": "(n, 3)"}[layout]
        raise InputError(f"pairs of shape {a.shape} and {b.shape}", None, f"both must be {wanted}")
    out = np.empty(a.shape[1 - AXIS[layout]], precision.carrier)
    Kernel.of_pairs(spec, form, setting, precision, layout).fill_pairs(a, b, out)
    return out


def limit(spec: Approximation, setting: Setting, precision: Precision) -> float:
    """Where the dark begins: from this cosine down, or this lambda up, the kernel's value is exactly 0.

    A support that ends says where. Exact Phong's power becomes 0 where it would be subnormal; at alpha 0 it never does.
    """
    if spec.cutoff is not None:
        return spec.cutoff(setting) * (1 + _ROOM)
    if setting.alpha == 0:
        return 0.0
    least = -1022.0 if precision == FLOAT64 else -126.0
    return float(2.0 ** (least * (1 + _ROOM) / setting.alpha))


def needs_gate(spec: Approximation, form: str, setting: Setting) -> bool:
    """False if a kernel is dark wherever a.b is not positive, by itself.

    In form `dot` lambda is then at least 1, whatever the lengths, so a support that ends before 1 is enough, if NaN is
    dark too. In the other forms it is not: short vectors have a small lambda at every angle.
    """
    if form != "dot" or spec.cutoff is None or spec.cutoff(setting) > _SURE:
        return True
    try:
        return bool(spec.bound(setting)(math.nan) != 0)
    except (ArithmeticError, ValueError):  # a plain body that cannot take NaN promises nothing about it
        return True


def read_only(array: Array) -> Array:
    """A view that cannot be written through: one type for compiled callers, whatever arrays they are given."""
    view = array.view()
    view.flags.writeable = False
    return view


def known_values(spec: Approximation, setting: Setting) -> tuple[tuple[str, int], ...]:
    """The arguments of the kernel that are known when compiling, with their values at this setting."""
    values = spec.coefficients(setting)
    return tuple((name, int(values[name])) for name in spec.knowns)


def coefficient_row(spec: Approximation, setting: Setting, precision: Precision) -> Array:
    """The kernel's run-time coefficients at this setting, each as the precision holds it, padded with zeros.

    returns  (MAX_COEFFICIENTS,) in the precision's carrier, in the order of the kernel's arguments
    """
    values = spec.coefficients(setting)
    row = np.zeros(MAX_COEFFICIENTS, precision.carrier)
    row[: len(spec.scalars)] = [precision.constant(values[name]) for name in spec.scalars]
    return row


def table_row(spec: Approximation, setting: Setting, precision: Precision) -> Array:
    """The kernel's table at this setting in the working precision; a single 0 where it has none.

    returns  (entries,) in the precision's carrier; InputError for more than intrinsics.MAX_TABLE entries, or none
    """
    table = np.zeros(1) if spec.table is None else spec.table(setting)
    if not 1 <= len(table) <= intrinsics.MAX_TABLE:
        raise InputError(
            f"the table of {spec.name!r} has {len(table)} entries", None, f"use 1 to {intrinsics.MAX_TABLE}"
        )
    return np.ascontiguousarray(precision.rounded(table))
