"""Checks that every approximation must pass: ours in the tests, and yours.

    from phongbench.testing import CHECKS
    for check in CHECKS:
        check(SPEC)

A check returns nothing or raises AssertionError saying what is wrong, and where.
"""

import inspect
import math
import platform
import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import product
from typing import Any

import mpmath
import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT16, FLOAT32, FLOAT64, PRECISIONS, Body, Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.kernel import Kernel
from phongbench.formulas.registry import example
from phongbench.formulas.spec import Approximation, Setting

#: cosines over the whole circle: coarse everywhere, fine near the peak, where highlights of high alpha live
COSINES = np.concatenate([np.linspace(-1.0, 0.9, 39), 1.0 - np.geomspace(0.1, 1e-6, 60), [1.0]])
HOSTILE = (math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 2.0, 1e-40, -1e-40, 1e30, -1e30)
_PACKED = {
    "x86": r"\bv?(?:add|sub|mul|div|fn?m(?:add|sub)\d+)p[sd]\b",
    "arm": r"\bf(?:add|sub|mul|mla|mls|div)\s+v\d+\.(?:2s|4s|2d)",
}


def settings(spec: Approximation) -> Iterator[Setting]:
    """Settings the approximation accepts, from a spread of alpha and gamma, every slope and every space."""
    gammas = (2, 64) if spec.uses_gamma else (None,)
    for alpha, gamma, slope, space in product((1.0, 10.0, 64.0, 1000.0), gammas, spec.slopes, spec.spaces):
        setting = Setting(alpha, gamma, slope, space)
        try:
            spec.check(setting)
        except InputError:
            continue
        yield setting


def coordinates(spec: Approximation, cosine: Array = COSINES) -> Array:
    """What the kernel takes first, for these cosines: themselves, or the exact cosine deficit."""
    return cosine if spec.coordinate == "cosine" else 1.0 - cosine


def compiled(spec: Approximation, setting: Setting, precision: Precision, coordinate: Array) -> Array:
    """Values of the compiled kernel in a precision, held by its carrier."""
    with np.errstate(all="ignore"):
        given = precision.rounded(coordinate)
        return Kernel.of(spec, setting, precision).values(given, np.ones_like(given))


def over(body: Body, precision: Precision, *columns: Any, **known: int) -> Array:
    """Values of any lowered body, compiled, over columns of numbers: one column for each argument that is not known."""
    loops: dict[int, Callable[[Body], Callable[..., None]]] = {1: _over_1, 2: _over_2, 6: _over_6}
    with np.errstate(all="ignore"):
        rounded = [np.atleast_1d(precision.rounded(c)) for c in columns]
        given = [np.ascontiguousarray(c) for c in np.broadcast_arrays(*rounded)]
        out = np.empty_like(given[0])
        jit.driver(loops[len(columns)](lower(body, precision, **known)))(out, *given)
    return out


def _over_1(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i])

    return run


def _over_2(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array, b: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i], b[i])

    return run


def _over_6(f: Body) -> Callable[..., None]:
    def run(out: Array, a: Array, b: Array, c: Array, d: Array, e: Array, g: Array) -> None:
        for i in range(len(out)):
            out[i] = f(a[i], b[i], c[i], d[i], e[i], g[i])

    return run


def plain(spec: Approximation, setting: Setting, number: Callable[[Any], Any]) -> Callable[[float], Any]:
    """The plain body as a function of the coordinate, in one kind of number: float, np.float16, mpmath.mpf."""
    values = {a: v if a in spec.knowns else number(v) for a, v in spec.coefficients(setting).items()}
    table = {} if spec.table is None else {"table": [number(v) for v in spec.table(setting).tolist()]}
    return lambda coordinate: spec.kernel(number(coordinate), **values, **table)


def check_describes_itself(spec: Approximation) -> None:
    """The kernel's docstring names formula, source, domain, every argument and what is returned; SPEC is complete."""
    text = inspect.getdoc(spec.kernel) or ""
    arguments = inspect.signature(spec.kernel).parameters
    for word in (*arguments, "returns", "Formula", "Source", "Domain"):
        _require(re.search(rf"^{word}\s+\S", text, re.MULTILINE), spec, f"the kernel's docstring does not say {word!r}")
    named = re.search(r"^Source\s+(\S+)", text, re.MULTILINE)
    _require(
        named and named[1] == spec.source.key, spec, f"docstring and SPEC differ in their source, {spec.source.key}"
    )
    for field in ("title", "formula", "domain"):
        _require(getattr(spec, field).strip(), spec, f"{field} is empty")
    _require(spec.cost.text.strip(), spec, "the cost is not described")
    _require(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", spec.name), spec, "its name must be a-z, 0-9 and hyphens")


def check_coefficients_are_finite(spec: Approximation) -> None:
    """At every setting there is one finite coefficient for each argument of the kernel, and its table is finite."""
    wanted = {a for a in spec.arguments if a != "table"}
    for setting in settings(spec):
        values = spec.coefficients(setting)
        _require(set(values) == wanted, spec, f"coefficients {sorted(values)} for arguments {sorted(wanted)}", setting)
        _require(all(map(math.isfinite, values.values())), spec, f"coefficients {values}", setting)
        _require(spec.table is None or np.isfinite(spec.table(setting)).all(), spec, "its table is not finite", setting)


def check_peak(spec: Approximation) -> None:
    """Where both directions are the same, the value is what SPEC says: 1 unless `peak` admits that it is missed."""
    peak = coordinates(spec, np.array([1.0]))
    for setting, precision in product(settings(spec), PRECISIONS.values()):
        value = float(compiled(spec, setting, precision, peak)[0])
        tolerance = 2 * precision.eps * (setting.gamma or 1)  # squarings multiply a rounding
        _require(abs(value - spec.peak) <= tolerance, spec, f"{value} at the peak in {precision.name}", setting)


def check_bounded_on_unit_vectors(spec: Approximation) -> None:
    """At no angle is the value below 0, above the peak, or not a number; where `tan2` is infinite neither."""
    coordinate = coordinates(spec)
    if spec.coordinate == "cosine_deficit":
        coordinate = np.append(coordinate, np.inf)
    for setting, precision in product(settings(spec), PRECISIONS.values()):
        values = compiled(spec, setting, precision, coordinate)
        highest = max(1.0, spec.peak) + 4 * precision.eps
        for where, value in zip(coordinate, values, strict=True):
            _require(0 <= value <= highest, spec, f"{value} at {spec.coordinate} {where} in {precision.name}", setting)


def check_falls_where_it_says_so(spec: Approximation) -> None:
    """The value never grows away from the peak by more than rounding, if SPEC says that it falls."""
    if not spec.falls:
        return
    cosines = 1 - np.concatenate([np.linspace(0, 1, 4001), np.logspace(-9, 0, 4001)])
    apart = np.sort(cosines)[::-1] if spec.coordinate == "cosine" else np.sort(1 - cosines)
    for setting in settings(spec):
        rise = float(np.diff(compiled(spec, setting, FLOAT64, apart)).max())
        _require(rise <= 1e-9, spec, f"grows by {rise:.3g} away from its peak", setting)


def check_exactly_zero_beyond_cutoff(spec: Approximation) -> None:
    """Beyond the cutoff the value is 0 and nothing else; half way to it there is light."""
    if spec.cutoff is None:
        return
    for setting, precision in product(settings(spec), (FLOAT32, FLOAT64)):
        end = spec.cutoff(setting)
        beyond = compiled(spec, setting, precision, end * np.array([1.00001, 1.1, 2.0, 100.0]))
        _require((beyond == 0).all(), spec, f"{beyond} beyond the cutoff {end} in {precision.name}", setting)
        inside = compiled(spec, setting, precision, np.array([end / 2]))
        _require(inside[0] > 0, spec, f"dark half way to the cutoff {end} in {precision.name}", setting)


def check_no_second_highlight(spec: Approximation) -> None:
    """Behind the surface nothing is brighter than at 90 degrees: an even power of a negative would shine again."""
    coordinate = coordinates(spec, np.linspace(0.0, -1.0, 101))
    for setting in settings(spec):
        values = compiled(spec, setting, FLOAT64, coordinate)
        _require(values.max() <= values[0] + 1e-12, spec, f"{values.max()} behind, {values[0]} at 90 degrees", setting)


def check_nan_and_infinity_do_not_raise(spec: Approximation) -> None:
    """NaN, infinities, zeros, subnormals and huge numbers go through; what comes out is counted, not judged."""
    for setting, precision in product(settings(spec), PRECISIONS.values()):
        _require(len(compiled(spec, setting, precision, np.array(HOSTILE))) == len(HOSTILE), spec, "no values", setting)


def check_compiled_equals_plain(spec: Approximation) -> None:
    """The compiled kernel computes what its plain body says, on floats, on 50 digits, and on NumPy's scalars.

    float64  within 1e-12 of the plain body on floats and on mpmath numbers
    float32  within what fused multiply-adds and the fast power may change
    float16  bit for bit, unless the cost counts a transcendental function: two steps of float16 at 1 then
    """
    at = coordinates(spec)
    for setting in settings(spec):
        size = max(setting.exponent, setting.gamma or 1)
        half = 0.0 if spec.cost.transcendentals == 0 else 2.0**-9
        with mpmath.workdps(50):
            _compare(spec, setting, FLOAT64, at[::4], mpmath.mpf, 1e-12)
        _compare(spec, setting, FLOAT64, at, float, 1e-12)
        _compare(spec, setting, FLOAT32, at, np.float32, 1e-6 * (2 + 0.1 * size))
        _compare(spec, setting, FLOAT16, at, np.float16, half)


def _compare(
    spec: Approximation,
    setting: Setting,
    precision: Precision,
    at: Array,
    number: Callable[[Any], Any],
    tolerance: float,
) -> None:
    body = plain(spec, setting, number)
    with np.errstate(all="ignore"):
        at = at.astype(precision.dtype)
        expected = np.array([float(body(float(x))) for x in at])
    values = compiled(spec, setting, precision, at).astype(np.float64)
    worst = int(np.argmax(np.abs(values - expected)))
    message = f"{values[worst]} compiled, {expected[worst]} plain at {spec.coordinate} {at[worst]} in {precision.name}"
    _require(abs(values[worst] - expected[worst]) <= tolerance, spec, message, setting)


def check_no_double_in_float32(spec: Approximation) -> None:
    """Not one operation of the float32 loop is done in float64, which would cost lanes and hide float32's rounding."""
    if not jit.DISABLED:
        lines = [line.strip() for line in _code(spec)[0].splitlines() if re.search(r"\bdouble\b", line)]
        _require(not lines, spec, f"double in the float32 loop: {lines[:3]}")


def check_vectorises(spec: Approximation) -> None:
    """The float32 loop computes on whole vectors. Looked at on x86 and ARM only.

    Kernels with a table are looked at on x86 only, where a vector of lookups is an instruction.
    """
    family = {"x86_64": "x86", "amd64": "x86", "aarch64": "arm", "arm64": "arm"}.get(platform.machine().lower())
    if family and not (spec.table and family == "arm") and not jit.DISABLED:
        _require(re.search(_PACKED[family], _code(spec)[1]), spec, "its float32 loop computes one value at a time")


@cache
def _code(spec: Approximation) -> tuple[str, str]:
    return jit.code(Kernel.of(spec, example(spec), FLOAT32).loop)


def _require(condition: Any, spec: Approximation, message: str, setting: Setting | None = None) -> None:
    if not condition:
        raise AssertionError(f"{spec.name}: {message}" + (f" ({setting})" if setting else ""))


#: every check, in the order of what is most worth knowing first
CHECKS: tuple[Callable[[Approximation], None], ...] = (
    check_describes_itself,
    check_coefficients_are_finite,
    check_peak,
    check_bounded_on_unit_vectors,
    check_falls_where_it_says_so,
    check_exactly_zero_beyond_cutoff,
    check_no_second_highlight,
    check_nan_and_infinity_do_not_raise,
    check_compiled_equals_plain,
    check_no_double_in_float32,
    check_vectorises,
)
