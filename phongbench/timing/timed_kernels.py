"""What a timing run times: approximations, the three exact powers, and the ceilings, all behind one compiled signature.

Each kernel takes (a, b, coefficients, table, out) with a and b of shape (3, n), so one compiled driver times them all
over the same buffers, and differences are differences of the loops.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array, precision_named
from phongbench.errors import InputError, KernelError, MeasurementError
from phongbench.formulas import normalising, recipes
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import MAX_COEFFICIENTS, Approximation, Setting
from phongbench.inputs import pairs
from phongbench.inputs.configurations import normals_and_lights
from phongbench.inputs.plan import Cell
from phongbench.inputs.strata import STRATA
from phongbench.results.schema import BASELINE, COPY, DISTANT, DOT, FMA, LIBM, TRIAD, TWIN
from phongbench.timing.ceilings import bare_loop

#: fused multiply-adds of the row `fma`, one after the other for each element: as much arithmetic as a short formula has
CHAIN = 8
#: what is timed on several threads too: (name, gamma)
THREADED = ((BASELINE, None), (DOT, None), ("lyon", 8))
#: of formulas for raw vectors those that are timed beyond the first cache too: claims ask for them there
BEYOND_FIRST_CACHE = (
    "phong/each",
    "phong/once",
    "lyon:cross:8/once",
    "phong@reflect/each",
    "phong@lengthwise/once",
    "lyon:cross:8@lengthwise",
)
#: of recipes those that are timed for a light and a viewer at infinity, too: Blinn's promise is about these
AT_INFINITY = ("phong@reflect", "phong@lengthwise/once", "blinn@halfway/once")
#: the shininess at which kernels are timed, and a second one for integer powers, which alone depend on it
ALPHA, FURTHER_ALPHAS = 50.0, (64.0, 1000.0)
#: rows of the arrays a formula reads and writes; from N, L and V; from N where L and V are the same for all
ROWS, ROWS_OF_RECIPES, ROWS_AT_INFINITY = 7, 10, 4
#: what tells rows apart: name, lambda form, space, gamma, precision, recipe, normalise
Key = tuple[str, str, str, int | None, str, str, str]


def highlight_pairs(precision: Precision, seed: int, count: int, scale: float = 1 / ALPHA) -> tuple[Array, Array]:
    """Pairs of the highlight stratum, by default at shininess ALPHA: what kernels are timed on."""
    stratum = next(s for s in STRATA if s.name == "highlight")
    return pairs.pairs(stratum, precision, seed=seed, start=0, count=count, scale=scale)


def highlight_configurations(precision: Precision, seed: int, count: int) -> tuple[Array, Array, Array]:
    """The same pairs with what they are made from: a, V above L as (6, count), and N."""
    mirror, view = pairs.highlight_frames(seed, 0, count, 1 / ALPHA)
    normal, light = normals_and_lights(mirror, seed, 0)
    a, b, n = (v.astype(precision.carrier) for v in (mirror, np.concatenate([view, light]), normal))
    return a, b, n


@dataclass(frozen=True)
class TimedFormula:
    """A formula to be timed in one precision.

    Time depends neither on the exponent nor on the slope: they only choose coefficients.

    spec   its entry in the registry
    label  name in the table, where it is not the formula's own
    far    whether light and viewer are at infinity: its rows are named DISTANT + name
    """

    formula: Formula
    spec: Approximation
    precision: Precision
    alpha: float = ALPHA
    label: str = ""
    far: bool = False

    @classmethod
    def of(
        cls, spelling: str, precision: Precision, alpha: float = ALPHA, label: str = "", registry: Registry = REGISTRY
    ) -> "TimedFormula":
        """The formula of a spelling, e.g. "lyon:dot:8"."""
        formula = Formula.parse(spelling, registry)
        return cls(formula, formula.spec(registry), precision, alpha, label)

    @property
    def name(self) -> str:
        """What the row is called."""
        return DISTANT * self.far + (self.label or self.spec.name)

    @property
    def setting(self) -> Setting:
        """What its coefficients are made for."""
        return self.formula.setting(self.alpha)

    @property
    def key(self) -> Key:
        """What tells its row from others."""
        f = self.formula
        return self.name, f.lambda_form, f.space, f.gamma, self.precision.name, f.recipe, f.normalise


def timed_formulas(cells: Iterable[Cell], registry: Registry = REGISTRY) -> tuple[TimedFormula, ...]:
    """The formulas behind cells that differ in time, in the order first met, at shininess ALPHA where it is accepted.

    Emulated precisions are left out, and estimates of roots where the processor has none: their steps are conversions
    and tables, so their time says nothing about hardware that has them.
    """
    chosen: dict[Key, TimedFormula] = {}
    for cell in cells:
        spec, precision = cell.formula.spec(registry), precision_named(cell.precision)
        if not precision.rounds and (jit.ESTIMATES_ROOTS or NORMALISE[cell.formula.normalise].instruction is None):
            formula = replace(cell.formula, slope=spec.slopes[0])
            alpha = ALPHA if spec.accepts(formula.setting(ALPHA)) else cell.alpha
            timed = TimedFormula(formula, spec, precision, alpha)
            chosen.setdefault(timed.key, timed)
    far = [replace(timed, far=True) for timed in chosen.values() if str(timed.formula) in AT_INFINITY]
    return (*chosen.values(), *far)


@dataclass(frozen=True)
class TimedKernel:
    """A compiled kernel, with what it takes to run and to believe it.

    kernel      compiled loop (a, b, coefficients, table, out) with its arguments
    plain       float64 (3, m), (3, m) -> (m,)   the same values in plain Python, the compiled ones' yardstick
    tolerance   largest believable difference from `plain`
    rows        rows of n elements read and written
    compile_ms  milliseconds of compilation in this process, near 0 where it was done before
    """

    key: Key
    kernel: Kernel
    plain: Callable[[Array, Array], Array]
    tolerance: float
    rows: int = ROWS
    compile_ms: float = 0.0
    threads: int = 1

    @property
    def name(self) -> str:
        """What the row is called."""
        return self.key[0]

    @property
    def recipe(self) -> str:
        """How its pair is made; unless that is given, it takes N, and V above L."""
        return self.key[5]

    @property
    def as_given(self) -> bool:
        """True if it takes its pair as it is."""
        return self.key[5:] == (PAIR, "none")


def compiled(timed: TimedFormula) -> TimedKernel:
    """The formula's kernel, compiled now; MeasurementError where that fails, for whatever reason in the kernel."""
    spec, setting, precision, formula = timed.spec, timed.setting, timed.precision, timed.formula
    if precision.rounds:
        raise InputError(
            f"{precision.name} is emulated, so its time says nothing", timed.name, "time float32 or float64"
        )
    try:
        spec.check(setting)
        started = time.perf_counter()
        raw: dict[str, Any] = {"normalise": formula.normalise, "recipe": formula.recipe, "uniform": timed.far}
        kernel = Kernel.of_pairs(spec, formula.lambda_form, setting, precision, timed=True, **raw)
        took = 1e3 * (time.perf_counter() - started)
    except (KernelError, jit.compile_error(), ArithmeticError, LookupError, ValueError) as problem:
        raise MeasurementError(
            f"cannot be compiled: {problem}".splitlines()[0], timed.name, "fix its kernel"
        ) from problem
    rows = ROWS if formula.recipe == PAIR else ROWS_AT_INFINITY if timed.far else ROWS_OF_RECIPES
    tolerance = _tolerance(setting.exponent, precision) + _estimated(formula, setting.exponent)
    return TimedKernel(timed.key, kernel, _plain(timed), tolerance, rows, took)


def companions(precision: Precision, registry: Registry = REGISTRY) -> Iterator[TimedKernel]:
    """What every block holds: exact Phong (the baseline), its twin, libm's power, integer powers, the ceilings."""
    phong = compiled(TimedFormula.of(BASELINE, precision, registry=registry))
    yield phong
    yield replace(phong, key=(TWIN, *phong.key[1:]), compile_ms=0.0)
    yield _bare(LIBM, precision, _tolerance(ALPHA, precision), phong.plain)
    if "integer-power" in registry:
        for alpha in (ALPHA, *FURTHER_ALPHAS):
            label = "" if alpha == ALPHA else f"integer-power-{alpha:g}"
            yield compiled(TimedFormula.of("integer-power", precision, alpha, label, registry))
    rounding = 8 * float(np.finfo(precision.dtype).eps)
    yield _bare(COPY, precision, 0.0, lambda a, b: a[0], rows=2)
    yield _bare(TRIAD, precision, ALPHA * rounding, lambda a, b: a[0] + ALPHA * b[0], rows=3)
    yield _bare(DOT, precision, rounding, lambda a, b: (a * b[:3]).sum(axis=0))
    yield _bare(FMA, precision, CHAIN * rounding, _chained, rows=2)


def _chained(a: Array, b: Array) -> Array:
    value = a[0]
    for _ in range(CHAIN):
        value = value * a[0] + 1 / ALPHA
    return np.asarray(value)


def in_every_set(kernels: Iterable[TimedKernel]) -> list[TimedKernel]:
    """The kernels without those for raw vectors that are timed in the first cache only."""
    places = {
        (f.approximation, f.lambda_form, f.gamma, f.recipe, f.normalise) for f in map(Formula.parse, BEYOND_FIRST_CACHE)
    }
    return [k for k in kernels if k.as_given or (k.name, k.key[1], k.key[3], *k.key[5:]) in places]


def on_threads(kernels: Iterable[TimedKernel], counts: Iterable[int]) -> list[TimedKernel]:
    """The members of THREADED again, for each number of threads above 1."""
    return [
        replace(kernel, threads=count, compile_ms=0.0)
        for count in sorted(set(counts) - {1})
        for kernel in kernels
        if (kernel.name, kernel.key[3]) in THREADED and kernel.as_given
    ]


def _tolerance(exponent: float, precision: Precision) -> float:
    """Rounding a cosine or lambda costs some ulp, which the exponent magnifies; a wrong formula errs by far more."""
    return 200 * exponent * float(np.finfo(precision.dtype).eps)


def _estimated(formula: Formula, exponent: float) -> float:
    """How far the processor's estimates of both lengths may take a value from the table's, which stands for them."""
    return 4 * 1.5 * 2.0**-12 * exponent if NORMALISE[formula.normalise].instruction else 0.0


def _plain(timed: TimedFormula) -> Callable[[Array, Array], Array]:
    def values(a: Array, b: Array) -> Array:
        body, formula = timed.spec.bound(timed.setting), timed.formula
        b = np.repeat(b[:, :1], b.shape[1], axis=1) if timed.far else b
        with np.errstate(all="ignore"):
            if formula.recipe != PAIR:
                made = recipes.plain(formula.recipe)(*a, *b[3:], *b[:3])
                a, b = np.array(made[:3]), np.array(made[3:])
            coordinate, gate = normalising.plain(formula.lambda_form, formula.normalise)(tuple(a), tuple(b[:3]))
        pairs = zip(np.asarray(coordinate).tolist(), np.asarray(gate).tolist(), strict=True)
        return np.array([float(body(x)) if g > 0 else 0.0 for x, g in pairs])

    return values


def _bare(
    name: str, precision: Precision, tolerance: float, plain: Callable[[Array, Array], Array], rows: int = ROWS
) -> TimedKernel:
    started = time.perf_counter()
    loop = bare_loop(name, precision)
    took = 1e3 * (time.perf_counter() - started)
    row = np.zeros(MAX_COEFFICIENTS, precision.carrier)
    row[0], row[1] = precision.constant(ALPHA), precision.constant(1 / ALPHA)
    key = (name, "none", "reflect", None, precision.name, PAIR, "none")
    return TimedKernel(key, Kernel(loop, row, np.zeros(1, precision.carrier)), plain, tolerance, rows, took)
