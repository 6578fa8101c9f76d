"""Loops that are timed beside formulas and are none: libm's power, and what the machine can do at best."""

from functools import cache
from typing import Any

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision, lower
from phongbench.formulas import lambda_forms, pair_kernels
from phongbench.results.schema import COPY, DOT, FMA, LIBM, TRIAD


@cache
def bare_loop(name: str, precision: Precision) -> Any:
    """The compiled loop of this name: of the signature of formulas over pairs, whatever it reads of it."""
    dot, zero = lower(lambda_forms.dot, precision), precision.constant(0.0)

    def libm(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        alpha = coefficients[0]
        for i in range(len(out)):
            x = dot(a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i])
            out[i] = x**alpha if x > zero else zero

    def copy(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        for i in range(len(out)):
            out[i] = a[0, i]

    def triad(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        factor = coefficients[0]
        for i in range(len(out)):
            out[i] = a[0, i] + factor * b[0, i]

    def product(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        for i in range(len(out)):
            out[i] = dot(a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i])

    def chain(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        step = coefficients[1]
        for i in range(len(out)):
            x = a[0, i]
            y = x * x + step
            y = y * x + step
            y = y * x + step
            y = y * x + step
            y = y * x + step
            y = y * x + step
            y = y * x + step
            out[i] = y * x + step

    body = {LIBM: libm, COPY: copy, TRIAD: triad, DOT: product, FMA: chain}[name]
    return jit.elementwise(pair_kernels.pairs_signature(precision.carrier), body)
