"""How bodies that languages have words for are written, in GLSL's words and those of `lower`.

A primitive has no source that other languages could run, so each stands here; `float_bits` and `bits_float` read a
float as a whole number and back. For GPUs helpers of kernels stand here too: a GPU flushes subnormal numbers, so chains
of products need no guard against them, and limits a result to 0..1 for nothing.
"""

from collections.abc import Mapping

from phongbench.compiler import elementary, float_bits
from phongbench.compiler.lowering import Body, Table

PRIMITIVES: Mapping[Body, str] = {
    elementary.power: "_power(x, y)",
    elementary.exponential: "exp2(1.4426950408889634 * x)",
    elementary.exp2: "exp2(t)",
    elementary.square_root: "sqrt(x)",
    elementary.arc_cosine: "acos(clamp(x, -1.0, 1.0))",
    float_bits.binary_exponent: "floor(log2(x) + 0.5)",
    float_bits.binary_mantissa: "x / exp2(floor(log2(x) + 0.5))",
    float_bits.shifted: "round(t)",
    float_bits.unshifted: "s",
    float_bits.scaled: "x * exp2(s)",
    elementary.linear_log2: "_cast(_int_difference(float_bits(x), 1065353216)) / 8388608.0",
    float_bits.from_linear: "_from_linear(t)",
    elementary.linear_exp2: (
        "_select(t < -126.0, 0.0, bits_float(_int_sum(_index(clamp(t, -126.0, 127.0) * 8388608.0), 1065353216)))"
    ),
}
#: instead, or besides, where the language runs on a GPU
ON_GPU: Mapping[Body, str] = {
    elementary.positive_part: "max(x, 0.0)",
    elementary.clamped: "clamp(x, low, high)",
    elementary.above_underflow: "max(x, 0.0)",
}


def interpolated(table: Table, position: float) -> float:
    """As `elementary.interpolated`, of a table with its last entry twice: the last position needs no other index."""
    inside = elementary.clamped(position, 0.0, float(len(table) - 1))
    i = int(inside)
    value: float = table[i] + (inside - float(i)) * (table[i + 1] - table[i])
    return value


def clamped(x: float, low: float, high: float) -> float:
    """As `elementary.clamped`, by choices one after the other: a maximum and a minimum to compilers."""
    above = x if x > low else low
    return above if above < high else high


def where_above(value: float, x: float, least: float) -> float:
    """As `elementary.where_above`, of a value that is too small to see anyway."""
    return value


#: what is written in the place of a body where it is not spelled
INSTEAD: Mapping[Body, Body] = {
    elementary.interpolated: interpolated,
    elementary.clamped: clamped,
    elementary.where_above: where_above,
}
