"""Compiled loops around the scalar bodies: the coordinates of pairs, and the values of an approximation over them.

Every loop is compiled once for (approximation, precision, known arguments) and called through a pointer, so nothing is
compiled again for another alpha, beta or lambda form.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench import intrinsics, jit, vectors
from phongbench.errors import InputError
from phongbench.lowering import FLOAT64, Body, Precision, lower
from phongbench.spec import MAX_COEFFICIENTS, Approximation, Setting

Array = NDArray[Any]

#: rows of a coordinate block: the lambda forms, the cosine, and a row of ones that serves as the gate of ungated cells
FORM_ROW = {form: row for row, form in enumerate(vectors.LAMBDA_FORMS)}
COSINE_ROW = len(FORM_ROW)
OPEN_ROW = COSINE_ROW + 1
COORDINATE_ROWS = OPEN_ROW + 1


def values_signature(dtype: Any) -> Any:
    """(coordinate, gate, coefficients, table, out), all one-dimensional of this dtype."""
    row = jit.array_type(dtype)
    return jit.signature(row, row, row, row, row)


def coordinates_signature(dtype: Any) -> Any:
    """(a, b, out): pairs of shape (3, n) in, a block of COORDINATE_ROWS rows out."""
    block = jit.array_type(dtype, 2)
    return jit.signature(block, block, block)


#: inside drivers: (address, array) -> the compiled loop at that address, for arrays of that dtype
values_at, coordinates_at = intrinsics.function_at(values_signature), intrinsics.function_at(coordinates_signature)


def values_kernel(spec: Approximation, precision: Precision, known: tuple[tuple[str, int], ...] = ()) -> Any:
    """A compiled loop out[i] = kernel(coordinate[i], coefficients) where gate[i] > 0, else 0; see `values_signature`.

    spec       whose kernel
    precision  the working precision: arrays are of its carrier
    known      pairs (name, value) of the kernel's arguments that are known when compiling, e.g. (("n", 3),)
    """
    return _values_kernel(spec.kernel, _wiring(spec), precision, known)


#: a support that ends here ends before 90 degrees, with room for rounding
_SURE = 0.99


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
    out = np.empty_like(coordinate)
    kernel = values_kernel(spec, FLOAT64, known_values(spec, setting))
    fill_values(
        jit.address(kernel),
        coordinate,
        gate,
        coefficient_row(spec, setting, FLOAT64),
        table_row(spec, setting, FLOAT64),
        out,
    )
    return out


def deficit_of_angle(form: str, cosine: Any) -> Any:
    """Lambda of unit vectors at this cosine, in exact arithmetic: what each form sees of an angle.

    cosine  an array, or any kind of number
    """
    if form in ("dot", "difference"):
        return 1 - cosine
    sine_squared = 1 - cosine * cosine
    if form == "cross":
        return sine_squared / 2
    with np.errstate(divide="ignore"):
        return sine_squared / (2 * (cosine * cosine))


def curve(spec: Approximation, form: str, setting: Setting, cosine: Array) -> Array:
    """The highlight in float64 at these cosines between (R, V): what a plot against the angle shows.

    form     one of the approximation's lambda forms
    cosine   (n,) in [-1, 1]
    returns  (n,) float64

    In half space the coplanar (N, H) of the same configuration is used: its angle is half of that between R and V.
    """
    cosine = np.asarray(cosine, dtype=np.float64)
    own = np.sqrt((1 + cosine) / 2) if setting.space == "half" else cosine
    return evaluate(spec, setting, own if form == "none" else deficit_of_angle(form, own), own)


def coordinates(precision: Precision, a: Array, b: Array) -> Array:
    """The COORDINATE_ROWS rows of pairs: every lambda form, the cosine, and ones; computed in this precision.

    a, b  (3, n) in the precision's carrier
    """
    out = np.empty((COORDINATE_ROWS, a.shape[1]), precision.carrier)
    fill_coordinates(jit.address(coordinates_kernel(precision)), a, b, out)
    return out


@jit.driver
def fill_coordinates(address: int, a: Array, b: Array, out: Array) -> None:
    """Call the loop of `coordinates_kernel` at this address, on arrays as in `coordinates_signature`."""
    coordinates_at(address, out)(a, b, out)


@jit.driver
def fill_values(address: int, coordinate: Array, gate: Array, coefficients: Array, table: Array, out: Array) -> None:
    """Call the loop of `values_kernel` at this address, on arrays as in `values_signature`."""
    values_at(address, coordinate)(coordinate, gate, coefficients, table, out)


def _wiring(spec: Approximation) -> tuple[str, ...]:
    """The kernel's run-time arguments after the coordinate, as names of the loop: c0, c1, ... and table."""
    names = {name: f"c{i}" for i, name in enumerate(spec.scalars)} | {"table": "table"}
    return tuple(names[a] for a in spec.arguments if a in names)


def _bound(kernel: Body, wiring: tuple[str, ...], precision: Precision, known: tuple[tuple[str, int], ...]) -> Body:
    """The lowered kernel as a function of (coordinate, c0, c1, c2, c3, table), whatever it takes of these."""
    namespace: dict[str, Any] = {"__name__": __name__, "kernel": lower(kernel, precision, **dict(known))}
    text = f"def bound(x, c0, c1, c2, c3, table): return kernel({', '.join(('x', *wiring))})"
    exec(compile(text, f"<{kernel.__module__}.bound>", "exec"), namespace)
    bound: Callable[..., Any] = jit.inline(namespace["bound"])
    return bound


@cache
def _values_kernel(
    kernel: Body, wiring: tuple[str, ...], precision: Precision, known: tuple[tuple[str, int], ...]
) -> Any:
    bound, zero = _bound(kernel, wiring, precision, known), precision.constant(0.0)

    def values(coordinate: Array, gate: Array, coefficients: Array, table: Array, out: Array) -> None:
        c0, c1, c2, c3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
        local = intrinsics.on_stack(table)
        for i in range(len(coordinate)):
            value = bound(coordinate[i], c0, c1, c2, c3, local)
            out[i] = value if gate[i] > zero else zero

    return jit.elementwise(values_signature(precision.carrier), values)


@cache
def bound_parts(
    spec: Approximation, form: str, precision: Precision, known: tuple[tuple[str, int], ...]
) -> tuple[Body, Body]:
    """For loops of other shapes: the kernel as a function of (coordinate, c0, c1, c2, c3, table), and the coordinate as
    one of the six components, both compiled into whatever calls them.
    """
    body = vectors.dot if form == "none" else vectors.LAMBDA_FORMS[form]
    return _bound(spec.kernel, _wiring(spec), precision, known), lower(body, precision)


@cache
def coordinates_kernel(precision: Precision) -> Any:
    """A compiled loop filling a block of COORDINATE_ROWS rows from a and b of shape (3, n)."""
    forms = [lower(body, precision) for body in vectors.LAMBDA_FORMS.values()]
    dot, difference, cross, tangent = forms
    cosine, one = lower(vectors.dot, precision), precision.constant(1.0)

    def coordinates(a: Array, b: Array, out: Array) -> None:
        for i in range(a.shape[1]):
            ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
            out[0, i] = dot(ax, ay, az, bx, by, bz)
            out[1, i] = difference(ax, ay, az, bx, by, bz)
            out[2, i] = cross(ax, ay, az, bx, by, bz)
            out[3, i] = tangent(ax, ay, az, bx, by, bz)
            out[4, i] = cosine(ax, ay, az, bx, by, bz)
            out[5, i] = one

    return jit.elementwise(coordinates_signature(precision.carrier), coordinates)
