"""Kernels that leave out blocks of pairs whose highlight is exactly 0, beside the plain ones: when does skipping pay?

A block is looked at whole: its coordinates are computed with vectors, and where all of them lie beyond the cutoff it is
filled with zeros; else the plain loop runs over it. The results are those of the plain kernel, bit for bit.

How often that happens is a matter of the share of lit pairs and of how they lie. Here they lie together, as a highlight
does in an image; scattered at random, one lit pair in a hundred leaves half of all blocks of 64 something to do.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Body, Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels, lambda_forms, pair_kernels
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import Kernel, known_values, limit
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation, Setting
from phongbench.timing import timed_kernels
from phongbench.timing.timed_kernels import ALPHA, TimedFormula, TimedKernel

#: shares of lit pairs that are timed
LIT = (0.01, 0.1, 0.5, 1.0)
#: pairs that are skipped together. 16 costs less where the lit ones are scattered, but its test weighs more
BLOCK = 64
#: what is timed plain and skipping
PAIRED = (Formula.parse("phong"), Formula.parse("lyon:dot:8"))


def skip_kernel(spec: Approximation, form: str, setting: Setting, precision: Precision) -> Any:
    """`pair_kernels.pairs_kernel` in blocks that may be skipped; its coefficients are followed by `limit`."""
    bound, coordinate, _ = coordinate_kernels.bound_parts(spec, form, precision, known_values(spec, setting))
    return _skip_kernel(bound, coordinate, form, precision)


@cache
def _skip_kernel(bound: Body, coordinate: Body, form: str, precision: Precision) -> Any:
    zero, cosine = precision.constant(0.0), lower(lambda_forms.dot, precision)
    sign, none, last, width = precision.constant(1.0 if form == "none" else -1.0), np.int32(0), MAX_COEFFICIENTS, BLOCK

    entry, put = intrinsics.entry, intrinsics.put

    def skipping(a: Array, b: Array, coefficients: Array, table: Array, out: Array) -> None:
        c0, c1, c2, c3, dark = coefficients[0], coefficients[1], coefficients[2], coefficients[3], coefficients[last]
        local = intrinsics.on_stack(table)
        ax, ay, az, bx, by, bz = a[0], a[1], a[2], b[0], b[1], b[2]
        whole = len(out) // width * width
        for start in range(0, whole, width):
            lit = none
            for j in range(width):
                i = start + j
                x = coordinate(entry(ax, i), entry(ay, i), entry(az, i), entry(bx, i), entry(by, i), entry(bz, i))
                lit |= np.int32(sign * x > sign * dark)
            if lit != none:
                for j in range(width):
                    i = start + j
                    px, py, pz = entry(ax, i), entry(ay, i), entry(az, i)
                    qx, qy, qz = entry(bx, i), entry(by, i), entry(bz, i)
                    value = bound(coordinate(px, py, pz, qx, qy, qz), c0, c1, c2, c3, local)
                    put(out, i, value if cosine(px, py, pz, qx, qy, qz) > zero else zero)
            else:
                for j in range(width):
                    put(out, start + j, zero)
        for i in range(whole, len(out)):
            px, py, pz, qx, qy, qz = ax[i], ay[i], az[i], bx[i], by[i], bz[i]
            value = bound(coordinate(px, py, pz, qx, qy, qz), c0, c1, c2, c3, local)
            out[i] = value if cosine(px, py, pz, qx, qy, qz) > zero else zero

    return jit.elementwise(pair_kernels.pairs_signature(precision.carrier), skipping)


def kernels(precision: Precision) -> list[TimedKernel]:
    """What a block about skipping holds: the usual companions, and each of PAIRED plain and skipping."""
    found = list(timed_kernels.companions(precision, {f.approximation: f.spec() for f in PAIRED}))
    for formula in PAIRED:
        name, spec, setting = formula.approximation, formula.spec(), formula.setting(ALPHA)
        plain = timed_kernels.compiled(TimedFormula(formula, spec, precision, label=f"{name}-plain"))
        started = time.perf_counter()
        loop = skip_kernel(spec, formula.lambda_form, setting, precision)
        took = 1e3 * (time.perf_counter() - started)
        row = np.append(plain.kernel.coefficients, precision.constant(limit(spec, setting, precision)))
        skipping = Kernel(loop, row, plain.kernel.table)
        found += [plain, replace(plain, key=(f"{name}-skip", *plain.key[1:]), kernel=skipping, compile_ms=took)]
    return found


def names() -> frozenset[str]:
    """The rows that a block about skipping is timed for; the others in it are what they are compared with."""
    return frozenset(f"{formula.approximation}-{kind}" for formula in PAIRED for kind in ("plain", "skip"))


def inputs(lit: float) -> Callable[[Precision, int, int], tuple[Array, Array]]:
    """Makes pairs of which this share, lying together, is lit by all of PAIRED; the others look away."""
    return partial(_pairs, lit)


def _pairs(lit: float, precision: Precision, seed: int, count: int) -> tuple[Array, Array]:
    a, b = timed_kernels.highlight_pairs(precision, seed, count, scale=0.5 / ALPHA)
    run = math.ceil(lit * count)
    first = (count - run) // 2
    b[:, :first], b[:, first + run :] = -b[:, :first], -b[:, first + run :]
    return a, b
