"""What a compiled formula needs at one setting: known arguments, coefficients, table, and where it is dark."""

import math

import numpy as np

from phongbench.compiler import intrinsics
from phongbench.compiler.lowering import FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation, Setting

#: a support that ends here ends before 90 degrees, with room for rounding
_SURE = 0.99


#: room for the rounding of a coordinate; a pair this close to the cutoff is not skipped
_ROOM = 1e-5


def limit(spec: Approximation, setting: Setting, precision: Precision) -> float:
    """Where the dark begins: from this cosine down, or this lambda up, the kernel's value is exactly 0.

    A support that ends says where. Exact Phong's power becomes 0 where it would be subnormal.
    """
    if spec.cutoff is not None:
        return spec.cutoff(setting) * (1 + _ROOM)
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
