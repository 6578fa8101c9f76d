"""Compiled loops around the scalar bodies: the coordinates of pairs, and the values of an approximation over them.

Every loop is compiled once for (approximation, precision, known arguments) and called through a pointer, so nothing is
compiled again for another alpha, beta or lambda form.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, Protocol

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Body, Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.formulas import lambda_forms
from phongbench.formulas.normalising import NORMALISE, pair_bodies
from phongbench.formulas.recipes import PAIR, pair_of
from phongbench.formulas.spec import Approximation

#: rows of a coordinate block: the lambda forms, the cosine, and a row of ones that serves as the gate of ungated cells;
#: of raw vectors it holds what the gate asks
FORM_ROW = {form: row for row, form in enumerate(lambda_forms.LAMBDA_FORMS)}
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


class ScalarFormula(Protocol):
    """What a loop needs to know of a formula, be it a highlight or a reflectance: its body, and what that takes."""

    @property
    def kernel(self) -> Body:
        """The scalar body."""

    @property
    def arguments(self) -> tuple[str, ...]:
        """The body's arguments after the coordinate."""

    @property
    def scalars(self) -> tuple[str, ...]:
        """Those of them that are numbers given at run time."""


def values_kernel(spec: ScalarFormula, precision: Precision, known: tuple[tuple[str, int], ...] = ()) -> Any:
    """A compiled loop out[i] = kernel(coordinate[i], coefficients) where gate[i] > 0, else 0; see `values_signature`.

    spec       whose kernel
    precision  the working precision: arrays are of its carrier
    known      pairs (name, value) of the kernel's arguments that are known when compiling, e.g. (("n", 3),)
    """
    return _values_kernel(spec.kernel, _wiring(spec), precision, known)


def coordinates(precision: Precision, a: Array, b: Array, *, normalise: str = "none", recipe: str = PAIR) -> Array:
    """The COORDINATE_ROWS rows of pairs: every lambda form, the cosine, and ones; computed in this precision.

    a, b       (3, n) in the precision's carrier; of a recipe N, and V above L as (6, n)
    normalise  how lengths are removed, in the forms that take it
    """
    out = np.empty((COORDINATE_ROWS, a.shape[1]), precision.carrier)
    fill_coordinates(jit.address(coordinates_kernel(precision, normalise, recipe)), a, b, out)
    return out


@jit.driver
def fill_coordinates(address: int, a: Array, b: Array, out: Array) -> None:
    """Call the loop of `coordinates_kernel` at this address, on arrays as in `coordinates_signature`."""
    coordinates_at(address, out)(a, b, out)


@jit.driver
def fill_values(address: int, coordinate: Array, gate: Array, coefficients: Array, table: Array, out: Array) -> None:
    """Call the loop of `values_kernel` at this address, on arrays as in `values_signature`."""
    values_at(address, coordinate)(coordinate, gate, coefficients, table, out)


def _wiring(spec: ScalarFormula) -> tuple[str, ...]:
    """The kernel's run-time arguments after the coordinate, as names of the loop: c0, c1, ... and table."""
    names = {name: f"c{i}" for i, name in enumerate(spec.scalars)} | {"table": "table"}
    return tuple(names[a] for a in spec.arguments if a in names)


@cache
def _bound(kernel: Body, wiring: tuple[str, ...], precision: Precision, known: tuple[tuple[str, int], ...]) -> Body:
    """The lowered kernel as a function of (coordinate, c0, c1, c2, c3, table), whatever it takes of these."""
    namespace: dict[str, Any] = {"__name__": __name__, "kernel": lower(kernel, precision, **dict(known))}
    text = f"def bound(x, c0, c1, c2, c3, table): return kernel({', '.join(('x', *wiring))})"
    exec(compile(text, f"<{kernel.__module__}.bound>", "exec"), namespace)
    bound: Callable[..., Any] = jit.inline(namespace["bound"], precision.carrier)
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


def bound_parts(
    spec: Approximation,
    form: str,
    precision: Precision,
    known: tuple[tuple[str, int], ...],
    normalise: str = "none",
    *,
    timed: bool = False,
) -> tuple[Body, Body, Body]:
    """For loops of other shapes: the kernel as a function of (coordinate, c0, c1, c2, c3, table), and coordinate and
    gate as functions of the six components, all compiled into whatever calls them; the same for all formulas of a
    kernel.
    """
    return _bound(spec.kernel, _wiring(spec), precision, known), *pair_bodies(form, normalise, precision, timed)


@cache
def coordinates_kernel(precision: Precision, normalise: str = "none", recipe: str = PAIR) -> Any:
    """A compiled loop filling a block of COORDINATE_ROWS rows from a and b of shape (3, n), b of (6, n) for a recipe.

    The forms that the way to normalise does not take are of the vectors as they are. Where lengths are removed or a
    pair is made, the last row holds what the gate asks instead of ones.
    """
    return _coordinates_kernel(precision, normalise) if recipe == PAIR else _of_recipe(precision, normalise, recipe)


def _form_bodies(precision: Precision, normalise: str) -> list[Body]:
    """Of each row but the ones: its body of six components."""
    forms = (*lambda_forms.LAMBDA_FORMS, "none")
    known = [form for form, _ in NORMALISE[normalise].forms] or forms
    return [pair_bodies(form, normalise if form in known else "none", precision)[0] for form in forms]


@cache
def _ones(precision: Precision) -> Body:
    one = precision.constant(1.0)

    def ones(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> Any:
        return one

    return jit.inline(ones, precision.carrier)


@cache
def _coordinates_kernel(precision: Precision, normalise: str) -> Any:
    dot, difference, cross, tangent, cosine = _form_bodies(precision, normalise)
    gate = _ones(precision) if normalise == "none" else pair_bodies("none", normalise, precision)[1]

    def coordinates(a: Array, b: Array, out: Array) -> None:
        for i in range(a.shape[1]):
            ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
            out[0, i] = dot(ax, ay, az, bx, by, bz)
            out[1, i] = difference(ax, ay, az, bx, by, bz)
            out[2, i] = cross(ax, ay, az, bx, by, bz)
            out[3, i] = tangent(ax, ay, az, bx, by, bz)
            out[4, i] = cosine(ax, ay, az, bx, by, bz)
            out[5, i] = gate(ax, ay, az, bx, by, bz)

    return jit.elementwise(coordinates_signature(precision.carrier), coordinates)


@cache
def _of_recipe(precision: Precision, normalise: str, recipe: str) -> Any:
    dot, difference, cross, tangent, cosine = _form_bodies(precision, normalise)
    gate, pair = pair_bodies("none", normalise, precision)[1], pair_of(recipe, precision)

    def coordinates(n: Array, vl: Array, out: Array) -> None:
        for i in range(n.shape[1]):
            ax, ay, az, bx, by, bz = pair(
                n[0, i], n[1, i], n[2, i], vl[3, i], vl[4, i], vl[5, i], vl[0, i], vl[1, i], vl[2, i]
            )
            out[0, i] = dot(ax, ay, az, bx, by, bz)
            out[1, i] = difference(ax, ay, az, bx, by, bz)
            out[2, i] = cross(ax, ay, az, bx, by, bz)
            out[3, i] = tangent(ax, ay, az, bx, by, bz)
            out[4, i] = cosine(ax, ay, az, bx, by, bz)
            out[5, i] = gate(ax, ay, az, bx, by, bz)

    return jit.elementwise(coordinates_signature(precision.carrier), coordinates)
