"""What a timing run times: approximations, the three exact powers, and the ceilings, all behind one compiled signature.

Each contender takes (a, b, coefficients, table, out) with a and b of shape (3, n), so one compiled driver times them
all over the same buffers, and differences are differences of the loops.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError, KernelError, MeasurementError
from phongbench.formulas import lambda_forms, pair_kernels
from phongbench.formulas.kernel import coefficient_row, known_values, needs_gate, table_row
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation, Setting
from phongbench.results.schema import BASELINE, COPY, DOT, FMA, LIBM, TRIAD, TWIN

#: fused multiply-adds of the row `fma`, one after the other for each element: as much arithmetic as a short formula has
CHAIN = 8
#: what is timed on several threads too: (name, gamma)
THREADED = ((BASELINE, None), (DOT, None), ("lyon", 8))
#: the shininess at which kernels are timed, and a second one for integer powers, which alone depend on it
ALPHA, FURTHER_ALPHAS = 50.0, (64.0, 1000.0)
#: rows of the arrays a formula reads and writes
ROWS = 7


@dataclass(frozen=True)
class Subject:
    """A kernel to be timed.

    Time depends neither on alpha nor on the beta policy, so the setting's slope is ignored and its alpha only chooses
    coefficients.
    label  str   name in the table, where it is not the approximation's own
    """

    approximation: Approximation
    lambda_form: str
    setting: Setting
    precision: Precision
    label: str = ""

    @property
    def name(self) -> str:
        """What the row is called."""
        return self.label or self.approximation.name

    @property
    def gamma(self) -> int | None:
        """The setting's gamma if the approximation has one."""
        return self.setting.gamma if self.approximation.uses_gamma else None

    @property
    def key(self) -> tuple[str, str, str, int | None, str]:
        """What tells rows apart: name, lambda form, space, gamma, precision."""
        return self.name, self.lambda_form, self.setting.space, self.gamma, self.precision.name


def subjects(cells: Iterable[tuple[Approximation, str, Setting, Precision]]) -> tuple[Subject, ...]:
    """The distinct kernels behind cells, in the order first met, at shininess ALPHA where it is accepted.

    Emulated precisions are left out: their steps are conversions, so their time says nothing about hardware that has
    them.
    """
    found: dict[Any, Subject] = {}
    for approximation, form, setting, precision in cells:
        if not precision.rounds:
            usual = replace(setting, alpha=ALPHA, slope=approximation.slopes[0])
            chosen = usual if approximation.accepts(usual) else replace(setting, slope=approximation.slopes[0])
            subject = Subject(approximation, form, chosen, precision)
            found.setdefault(subject.key, subject)
    return tuple(found.values())


@dataclass(frozen=True)
class Contender:
    """A subject compiled, with what it takes to run and to believe it.

    key           name, lambda form, space, gamma, precision
    kernel        compiled loop (a, b, coefficients, table, out)
    coefficients, table   its arguments
    plain         float64 (3, m), (3, m) -> (m,)   the same values in plain Python, the compiled ones' yardstick
    tolerance     largest believable difference from `plain`
    rows          rows of n elements read and written
    compile_ms    milliseconds of compilation in this process, near 0 where it was done before
    """

    key: tuple[str, str, str, int | None, str]
    kernel: Any
    coefficients: Array
    table: Array
    plain: Callable[[Array, Array], Array]
    tolerance: float
    rows: int = ROWS
    compile_ms: float = 0.0
    threads: int = 1

    @property
    def name(self) -> str:
        """What the row is called."""
        return self.key[0]


def compiled(subject: Subject) -> Contender:
    """The subject's kernel, compiled now; MeasurementError where that fails, for whatever reason in the kernel."""
    spec, setting, precision = subject.approximation, subject.setting, subject.precision
    if precision.rounds:
        raise InputError(
            f"{precision.name} is emulated, so its time says nothing", subject.name, "time float32 or float64"
        )
    try:
        spec.check(setting)
        started = time.perf_counter()
        known, gated = known_values(spec, setting), needs_gate(spec, subject.lambda_form, setting)
        kernel = pair_kernels.pairs_kernel(spec, subject.lambda_form, precision, known, gated=gated)
        took = 1e3 * (time.perf_counter() - started)
        row, table = coefficient_row(spec, setting, precision), table_row(spec, setting, precision)
    except (KernelError, jit.CompileError, ArithmeticError, LookupError, ValueError) as problem:
        raise MeasurementError(
            f"cannot be compiled: {problem}".splitlines()[0], subject.name, "fix its kernel"
        ) from problem
    return Contender(
        subject.key, kernel, row, table, _plain(subject), _tolerance(setting.exponent, precision), compile_ms=took
    )


def companions(precision: Precision, registry: Any = REGISTRY) -> Iterator[Contender]:
    """What every block holds: exact Phong (the baseline), its twin, libm's power, integer powers, the ceilings."""
    phong = compiled(Subject(registry[BASELINE], "none", Setting(ALPHA), precision))
    yield phong
    yield replace(phong, key=(TWIN, *phong.key[1:]), compile_ms=0.0)
    yield _bare(LIBM, precision, _tolerance(ALPHA, precision), phong.plain)
    whole = registry.get("integer-power")
    if whole is not None:
        yield compiled(Subject(whole, whole.lambda_forms[0], Setting(ALPHA), precision))
        for alpha in FURTHER_ALPHAS:
            yield compiled(Subject(whole, whole.lambda_forms[0], Setting(alpha), precision, f"{whole.name}-{alpha:g}"))
    rounding = 8 * float(np.finfo(precision.dtype).eps)
    yield _bare(COPY, precision, 0.0, lambda a, b: a[0], rows=2)
    yield _bare(TRIAD, precision, ALPHA * rounding, lambda a, b: a[0] + ALPHA * b[0], rows=3)
    yield _bare(DOT, precision, rounding, lambda a, b: (a * b).sum(axis=0))
    yield _bare(FMA, precision, CHAIN * rounding, _chained, rows=2)


def _chained(a: Array, b: Array) -> Array:
    value = a[0]
    for _ in range(CHAIN):
        value = value * a[0] + 1 / ALPHA
    return np.asarray(value)


def on_threads(group: Iterable[Contender], counts: Iterable[int]) -> list[Contender]:
    """The members of THREADED again, for each number of threads above 1."""
    return [
        replace(c, threads=count, compile_ms=0.0)
        for count in sorted(set(counts) - {1})
        for c in group
        if (c.name, c.key[3]) in THREADED
    ]


def _tolerance(exponent: float, precision: Precision) -> float:
    """Rounding a cosine or lambda costs some ulp, which the exponent magnifies; a wrong formula errs by far more."""
    return 200 * exponent * float(np.finfo(precision.dtype).eps)


def _plain(subject: Subject) -> Callable[[Array, Array], Array]:
    def values(a: Array, b: Array) -> Array:
        body = subject.approximation.bound(subject.setting)
        cosine = lambda_forms.dot(*a, *b)
        with np.errstate(all="ignore"):
            form = subject.lambda_form
            coordinate = cosine if form == "none" else lambda_forms.LAMBDA_FORMS[form](*a, *b)
        pairs = zip(np.asarray(coordinate).tolist(), np.asarray(cosine).tolist(), strict=True)
        return np.array([float(body(x)) if c > 0 else 0.0 for x, c in pairs])

    return values


def _bare(
    name: str, precision: Precision, tolerance: float, plain: Callable[[Array, Array], Array], rows: int = ROWS
) -> Contender:
    started = time.perf_counter()
    kernel = _bare_kernel(name, precision)
    took = 1e3 * (time.perf_counter() - started)
    row = np.zeros(MAX_COEFFICIENTS, precision.carrier)
    row[0], row[1] = precision.constant(ALPHA), precision.constant(1 / ALPHA)
    key = (name, "none", "reflect", None, precision.name)
    return Contender(key, kernel, row, np.zeros(1, precision.carrier), plain, tolerance, rows, took)


@cache
def _bare_kernel(name: str, precision: Precision) -> Any:
    """Loops that are no formula of the registry: libm's power, and the ceilings."""
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
