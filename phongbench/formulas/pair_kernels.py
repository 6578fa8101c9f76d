"""Compiled loops from vectors to highlights: what is timed, and what shades.

One pass: the lambda form of each pair, the kernel, the gate. Every loop is compiled once for all formulas that share a
scalar kernel, whatever their coefficients, as in coordinate_kernels.py.
"""

from functools import cache
from typing import Any

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Body, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas.coordinate_kernels import bound_parts
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, pair_of
from phongbench.formulas.spec import Approximation


def pairs_signature(dtype: Any) -> Any:
    """(a, b, coefficients, table, out): a and b of shape (3, n) or (n, 3), which may be read-only."""
    row, block = jit.array_type(dtype), jit.array_type(dtype, 2, readonly=True)
    return jit.signature(block, block, row, row, row)


#: inside drivers: (address, array) -> the compiled loop at that address, for arrays of that dtype
pairs_at = intrinsics.function_at(pairs_signature)


def pairs_kernel(
    spec: Approximation,
    form: str,
    precision: Precision,
    known: tuple[tuple[str, int], ...] = (),
    *,
    layout: str = "soa",
    gated: bool = True,
    normalise: str = "none",
    recipe: str = PAIR,
    uniform: bool = False,
    timed: bool = False,
) -> Any:
    """A compiled loop out[i] = kernel(lambda form of the i-th pair) where a.b > 0, else 0; see `pairs_signature`.

    form    one of the approximation's lambda forms; none for kernels of the cosine
    known   as for `coordinate_kernels.values_kernel`
    layout  "soa": a and b of shape (3, n), a row per component; "aos": of shape (n, 3), a row per vector
    gated   False where `needs_gate` says that the test of a.b changes nothing
    normalise, recipe  of the formula; with a recipe a is N, and b is V above L, (6, n) in layout "soa"
    timed    True where an instruction is to be run instead of what stands for it, see `normalising.pair_bodies`
    uniform  with a recipe: light and viewer are at infinity, so that L and V are those of the first triple for all
    """
    bound, coordinate, gate = bound_parts(spec, form, precision, known, normalise, timed=timed)
    if timed and NORMALISE[normalise].instruction and recipe == PAIR:
        return _estimating_kernel(bound, coordinate, gate, precision, gated)
    if recipe != PAIR:
        made = _uniform_kernel if uniform else _recipe_kernel
        return made(bound, coordinate, gate, recipe, precision, gated)
    return _pairs_kernel(bound, coordinate, gate, precision, layout, gated)


@jit.inline
def _of_rows(v: Any, component: int, i: int) -> Any:
    return v[component, i]


@jit.inline
def _of_vectors(v: Any, component: int, i: int) -> Any:
    return intrinsics.of_three(v, i, component)


#: layout -> the axis of components, and how one is read
AXIS, _PART = {"soa": 0, "aos": 1}, {"soa": _of_rows, "aos": _of_vectors}


@cache
def _pairs_kernel(bound: Body, coordinate: Body, gate: Body, precision: Precision, layout: str, gated: bool) -> Any:
    part, zero = _PART[layout], precision.constant(0.0)

    def pairs(a: Array, b: Array, coefficients: Array, table: Array, out: Array) -> None:
        c0, c1, c2, c3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
        local = intrinsics.on_stack(table)
        for i in range(len(out)):
            ax, ay, az = part(a, 0, i), part(a, 1, i), part(a, 2, i)
            bx, by, bz = part(b, 0, i), part(b, 1, i), part(b, 2, i)
            value = bound(coordinate(ax, ay, az, bx, by, bz), c0, c1, c2, c3, local)
            out[i] = value if not gated or gate(ax, ay, az, bx, by, bz) > zero else zero

    return jit.elementwise(pairs_signature(precision.carrier), pairs)


@cache
def _estimating_kernel(bound: Body, coordinate: Body, gate: Body, precision: Precision, gated: bool) -> Any:
    zero = precision.constant(0.0)

    def pairs(a: Array, b: Array, coefficients: Array, table: Array, out: Array) -> None:
        intrinsics.estimating()
        c0, c1, c2, c3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
        local = intrinsics.on_stack(table)
        for i in range(len(out)):
            ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
            value = bound(coordinate(ax, ay, az, bx, by, bz), c0, c1, c2, c3, local)
            out[i] = value if not gated or gate(ax, ay, az, bx, by, bz) > zero else zero

    return jit.elementwise(pairs_signature(precision.carrier), pairs)


@cache
def _recipe_kernel(bound: Body, coordinate: Body, gate: Body, recipe: str, precision: Precision, gated: bool) -> Any:
    pair, zero = pair_of(recipe, precision), precision.constant(0.0)

    def triples(n: Array, vl: Array, coefficients: Array, table: Array, out: Array) -> None:
        c0, c1, c2, c3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
        local = intrinsics.on_stack(table)
        for i in range(len(out)):
            ax, ay, az, bx, by, bz = pair(
                n[0, i], n[1, i], n[2, i], vl[3, i], vl[4, i], vl[5, i], vl[0, i], vl[1, i], vl[2, i]
            )
            value = bound(coordinate(ax, ay, az, bx, by, bz), c0, c1, c2, c3, local)
            out[i] = value if not gated or gate(ax, ay, az, bx, by, bz) > zero else zero

    return jit.elementwise(pairs_signature(precision.carrier), triples)


@cache
def _uniform_kernel(bound: Body, coordinate: Body, gate: Body, recipe: str, precision: Precision, gated: bool) -> Any:
    pair, zero = pair_of(recipe, precision), precision.constant(0.0)

    def normals(n: Array, vl: Array, coefficients: Array, table: Array, out: Array) -> None:
        c0, c1, c2, c3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
        local, vx, vy, vz = intrinsics.on_stack(table), vl[0, 0], vl[1, 0], vl[2, 0]
        lx, ly, lz = vl[3, 0], vl[4, 0], vl[5, 0]
        for i in range(len(out)):  # what is made of L and V alone is lifted out of it
            ax, ay, az, bx, by, bz = pair(n[0, i], n[1, i], n[2, i], lx, ly, lz, vx, vy, vz)
            value = bound(coordinate(ax, ay, az, bx, by, bz), c0, c1, c2, c3, local)
            out[i] = value if not gated or gate(ax, ay, az, bx, by, bz) > zero else zero

    return jit.elementwise(pairs_signature(precision.carrier), normals)


@jit.driver
def fill_pairs(address: int, a: Array, b: Array, coefficients: Array, table: Array, out: Array) -> None:
    """Call the loop of `pairs_kernel` at this address, on arrays as in `pairs_signature`."""
    pairs_at(address, out)(a, b, coefficients, table, out)
