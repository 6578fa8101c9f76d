"""Bounds that no conforming device exceeds: the emitted code, run on intervals by the accuracies that standards state.

What runs is the code that `phongbench shader` writes for GPUs, with its folded constants and its limits, not the
kernels' own body. The domain is one of

- `unit`    pairs that a shader made unit, v * inversesqrt(v.v), on a device of the same kind
- `short`   the same short of right angles, where some formulas divide by nothing: directions of form tan2 up to FAR
            degrees apart; of the recipe halfway coplanar light and viewer up to FAR degrees from the half way between
- `cosine`  the exact cosine is given, so that nothing is told of the dot product: forms none and dot alone

What has no bound on the first has a reason, `why_not`.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from phongbench.accuracy.enclosures.bounds import NotEnclosedError, Problem
from phongbench.accuracy.enclosures.coordinates import Lengths
from phongbench.accuracy.enclosures.devices import LARGEST_PRODUCT, PRECISIONS, AnyLength, Device
from phongbench.accuracy.enclosures.emitted import Direction, words
from phongbench.accuracy.enclosures.ends import Ends
from phongbench.accuracy.enclosures.spans import Span, enclosed
from phongbench.compiler.precisions import Precision
from phongbench.errors import InputError, KernelError
from phongbench.formulas.formula import Formula
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.shader_code.evaluated import highlight
from phongbench.formulas.shader_code.function import written
from phongbench.formulas.shader_code.languages import GLSL
from phongbench.formulas.spec import Approximation, Setting

#: how sharp a bound is, see `bounds.Problem`: exact Phong needs as many intervals as its error goes into 1
NOTHING, CUTS, ROUNDS, MOST = 5e-7, 3, 14, 300_000
DOMAINS = UNIT, SHORT, COSINE = "unit", "short", "cosine"
#: degrees, short of a right angle
FAR = 80.0
_FAR = math.cos(math.radians(FAR))
#: how far what a recipe makes is off, in units of its length. R: N is normalised (off by 4.5, twice in each of two
#: factors), N.L off by 3 and twice N.L times N by 1 each, and L subtracted. Of `lengthwise` N.L and N.N are off by 3,
#: their products by 1, their difference by 1. H: both directions by 4.5, over its least length, and their sum by 1.
#: What is flushed to 0 adds less than 1 in float16
_RECIPES = {"reflect": 31.0, "lengthwise": 14.0, "halfway": 9 / (2 * _FAR) + 3}
#: what a body raises that takes no intervals, branches too often, or is wrong
_FAILS = (TypeError, ArithmeticError, ValueError, NameError, AssertionError, InputError, KernelError)
_OPPOSITE = "the direction half way between light and viewer vanishes where they are opposite"


def made_unit(precision: Precision, length_error: float = 0.0) -> Lengths:
    """Lengths of v * inversesqrt(v.v), then up to `length_error` off.

    v.v errs by up to 3 units, of which the root leaves half; the reciprocal root errs by 2 and the product by 1: 4.5 in
    all. Squares that are flushed to 0 shorten v.v by up to 3 of the smallest normal numbers; v is from 1/4 to 4 long.
    """
    off = math.expm1(4.5 * math.log1p(precision.eps)) + 0.01 * precision.eps
    flushed = (1 - 48 * precision.tiny) ** -0.5
    return Lengths((1 - off) * (1 - length_error), (1 + off) * flushed * (1 + length_error))


def largest(
    spec: Approximation,
    formula: Formula,
    setting: Setting,
    precision: Precision,
    *,
    length_error: float = 0.0,
    budget: float | None = None,
    domain: str = UNIT,
    limited: bool = True,
) -> float:
    """An upper bound of the error on every conforming device; infinite where nothing limits it.

    formula       of a pair, or of raw vectors: then their lengths are any that the precision holds squares of
    length_error  how wrong the lengths of a pair may be beyond normalising, relative
    budget        as for `bounds.largest`
    domain        of DOMAINS
    limited       whether the code limits values of over-long vectors to 1, see `shader_code.function.written`
    Raises NotEnclosedError, with the reason, for code that cannot run on intervals, or is not written for GPUs.
    """
    if reason := unwritten(spec, formula, setting, precision):
        raise NotEnclosedError(reason)
    if domain == COSINE and (formula.raw or formula.lambda_form not in ("none", "dot")):
        raise NotEnclosedError("only a formula of the cosine can be given it")
    if formula.recipe == "halfway" and domain != SHORT:
        raise NotEnclosedError(_OPPOSITE)
    if length_error >= 1:
        return math.inf
    pair = lengths_of(formula, precision, length_error) if domain != COSINE else None
    end = 1 - _FAR if domain == SHORT and formula.lambda_form == "tan2" else 2.0
    try:
        values = _emitted(spec, _of_pair(formula), setting, precision, pair, limited=limited)
        problem = Problem(setting, values, end, nothing=NOTHING, cuts=CUTS, rounds=ROUNDS, most=MOST)
        if domain == COSINE and precision.listed:
            return _everywhere(problem, precision)
        return problem.largest(budget)
    except _FAILS as problem:
        raise NotEnclosedError(f"{spec.name} cannot run on intervals") from problem


def unwritten(spec: Approximation, formula: Formula, setting: Setting, precision: Precision) -> str:
    """Why no standard speaks of the code for GPUs in this precision on all of its domain; "" where one does."""
    if precision.name not in PRECISIONS:
        return f"no standard speaks of {precision.name}"
    try:
        written(spec, formula, setting, GLSL.in_precision(precision.name))
    except (InputError, KernelError) as problem:
        return problem.what
    except _FAILS:
        return f"{spec.name} has no code for GPUs"
    if formula.normalise != "none" and precision.largest < LARGEST_PRODUCT:
        return f"squares of vectors of lengths from 0.001 to 1000 leave the range of {precision.name}"
    return ""


def short_of(formula: Formula) -> str:
    """The domain `short` of a formula, in words."""
    if formula.recipe == "halfway":
        return f"on coplanar vectors up to {FAR:g} degrees of incidence"
    return f"up to {FAR:g} degrees between directions"


def why_not(spec: Approximation, formula: Formula, setting: Setting, precision: Precision) -> str:
    """Why nothing limits the error on all conforming devices, for a formula that has no bound on `unit`."""
    if reason := unwritten(spec, formula, setting, precision):
        return reason
    if formula.lambda_form == "tan2":
        return "it divides by the squared cosine, which vanishes at a right angle"
    if formula.recipe == "halfway":
        return _OPPOSITE
    return "what it may give overflows"


def _everywhere(problem: Problem, precision: Precision) -> float:
    """The largest at all cosines that the precision holds."""
    deficits = 1.0 - precision.representables(0.0, 1.0).astype(np.float64)
    return float(problem.errors(deficits, deficits).max())


def _of_pair(formula: Formula) -> Formula:
    """The formula for the pair that a recipe makes."""
    return replace(formula, recipe=PAIR)


def lengths_of(formula: Formula, precision: Precision, length_error: float) -> tuple[Lengths, Lengths]:
    """The lengths of both directions as the formula takes them."""
    exact = formula.normalise != "none"
    given = Lengths() if exact else made_unit(precision, length_error)  # any length is taken as 1
    if formula.recipe == PAIR:
        return given, given
    off = _RECIPES[formula.recipe] * precision.eps * (1 + 40 * precision.eps)
    if formula.recipe == "halfway":
        return given, Lengths(off=off) if exact else Lengths(2 * _FAR * (1 - off), 2 * (1 + off), off)
    growth = 3 if formula.recipe == "lengthwise" else 1  # R is then as long as the square of N times L
    return Lengths(given.low**growth, given.high**growth, off), given


def _emitted(
    spec: Approximation,
    formula: Formula,
    setting: Setting,
    precision: Precision,
    pair: tuple[Lengths, Lengths] | None,
    *,
    limited: bool,
) -> Callable[[Ends, Ends], tuple[Ends, Ends]]:
    """What the emitted code gives on intervals of deficits."""
    first, second = pair or (None, None)

    def body(deficit: Span) -> Span:
        rule = deficit.rule
        assert isinstance(rule, Device)
        code = highlight(spec, formula, setting, words(rule), limited=limited)
        a = Direction("a", rule, deficit.low, deficit.high, first)
        value = code(a, replace(a, which="b", lengths=second))
        if isinstance(value, Span) and value.rule.precision != precision:  # made of bits, in float32
            return rule.rounded(value.low, value.high)
        return value  # type: ignore[no-any-return]

    kind = AnyLength if formula.normalise != "none" else Device
    return lambda low, high: enclosed(body, low, high, precision, kind)
