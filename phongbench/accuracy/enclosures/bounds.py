"""Proven bounds of |value - exact Phong| over every pair of vectors that a shader calls unit.

The only thing that exact Phong knows of a pair is its deficit, 1 - cos(angle). So the deficits from 0 to a right angle
are cut into intervals; on each the kernel's plain body runs on what it may be given there (coordinates.py), with every
operation rounded both ways (spans.py), and exact Phong falls from one end of the interval to the other. The largest
difference bounds the error. Intervals whose bound is above what single deficits reach are cut again.

Needs no compiler. The bound is that of the formula as the kernels compute it, powers and exponentials by the compiled
ones of `compiler/elementary.py`; a shader's own may be worse.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench.accuracy.enclosures.coordinates import Lengths, coordinates, end_of_deficits, normalised
from phongbench.accuracy.enclosures.ends import Ends
from phongbench.accuracy.enclosures.spans import enclosed
from phongbench.compiler.precisions import Precision
from phongbench.formulas.spec import Approximation, Setting

#: intervals at first: evenly in exact Phong's value, then evenly in the logarithm of the deficit
LOBE, TAIL = 160, 48
#: a bound this close to what single deficits reach is sharp; errors below the second are nobody's concern
SHARP, NOTHING = 1.008, 2e-7
#: cuts of an interval, rounds of cutting, and intervals in all
CUTS, ROUNDS, MOST = 6, 6, 40_000
#: how far exact Phong in float64 may be off
_EXACT = 1e-13


class NotEnclosedError(Exception):
    """The body of this formula cannot run on intervals, so nothing is proven of it."""


def largest(
    spec: Approximation,
    form: str,
    setting: Setting,
    precision: Precision,
    *,
    length_error: float = 0.0,
    budget: float | None = None,
) -> float:
    """An upper bound of the error over all pairs of normalised vectors, infinite where nothing limits it.

    length_error  how wrong the lengths may be beyond that, relative
    budget        None for a sharp bound. Else what is returned only says on which side of the budget the bound is: it
                  is above the budget as soon as one deficit may reach beyond it, and else a bound not above it
    Raises NotEnclosedError for a body that cannot run on intervals.
    """
    if length_error >= 1:
        return math.inf  # one of the vectors may be no direction at all
    lengths = normalised(precision, length_error)
    end = end_of_deficits(precision, lengths)
    problem = Problem(setting, _kernel(spec, form, setting, precision, lengths), end)
    try:
        if spec.kind == "exact" and form == "none" and setting.alpha >= 1 and not precision.saturates:
            return problem.at_peak()
        return problem.largest(budget)
    except (TypeError, ArithmeticError, ValueError) as reason:  # the body takes no intervals, or branches too often
        raise NotEnclosedError(spec.name) from reason


@dataclass(frozen=True)
class Problem:
    """The largest error of what is computed on a domain.

    setting  whose exact Phong it stands for
    values   intervals of deficits, both ends (n,) -> what may be computed there, both ends (n,)
    end      the deficit from which on it is dark for sure, at least 1, or where the domain ends; 2 is that of opposite
             directions
    nothing  a bound this close to what single deficits reach is sharp
    cuts     of an interval in each of so many rounds, until there are more than `most`
    """

    setting: Setting
    values: Callable[[Ends, Ends], tuple[Ends, Ends]]
    end: float = 2.0
    nothing: float = NOTHING
    cuts: int = CUTS
    rounds: int = ROUNDS
    most: int = MOST

    def at_peak(self) -> float:
        """The bound of exact Phong: a coordinate that is off by a share and a power by another err most at the peak.

        (s c + e)^alpha - c^alpha and the power's own share grow with the cosine c where alpha >= 1.
        """
        return float(self.errors(np.zeros(1), np.zeros(1))[0])

    def largest(self, budget: float | None = None) -> float:
        """A sharp bound; with a budget, one that is not above it, or what a single deficit reaches beyond it."""
        enough, limit = (0.0, math.inf) if budget is None else (budget, budget)
        low, high = self._first()
        done = reached = worst = 0.0
        for turn in range(self.rounds):
            if turn < 2:  # later ones reach hardly more
                middle = 0.5 * (low + high)
                reached = max(reached, float(self.errors(middle, middle).max()))
            if reached > limit:
                return reached
            bounds = self.errors(low, high)
            loose = bounds > max(SHARP * reached, reached + self.nothing, enough)
            done = max(done, float(bounds[~loose].max(initial=0.0)))
            if not loose.any():
                return done
            worst = float(bounds[loose].max())
            low, high = _cut(low[loose], high[loose], self.cuts)
            if len(low) > self.most:
                break
        return max(done, worst)

    def errors(self, low: Ends, high: Ends) -> Ends:
        """A bound of the error on each interval of deficits."""
        with np.errstate(all="ignore"):  # ends may be infinite
            least, most = self.values(low, high)
        return np.maximum(most - self.exact(high), self.exact(low) - least) + _EXACT

    def exact(self, deficit: Ends) -> Ends:
        """Exact Phong of deficits of (R, V), or of (N, H) at half that angle."""
        d = np.minimum(deficit, 1.0)
        if self.setting.space == "half":
            d = np.minimum(2 * d * (2 - d), 1.0)
        with np.errstate(divide="ignore"):
            return np.exp(self.setting.alpha * np.log1p(-d))

    def _first(self) -> tuple[Ends, Ends]:
        exponent = self.setting.exponent
        lobe = -np.expm1(np.log1p(-np.arange(LOBE) / LOBE) / exponent)
        far = max(lobe[-1] * 1.01, self.end)
        near = lobe[1] * np.geomspace(2.0**-12, 0.5, 6)
        edges = np.concatenate([[0.0], near, lobe[1:], np.geomspace(lobe[-1], far, TAIL)[1:]])
        if self.end < 1:
            edges = np.append(edges[edges < self.end], self.end)
        return edges[:-1], edges[1:]


def _kernel(
    spec: Approximation, form: str, setting: Setting, precision: Precision, lengths: Lengths
) -> Callable[[Ends, Ends], tuple[Ends, Ends]]:
    """What the kernel gives, behind its gate."""
    body = _body(spec, setting, precision)

    def values(low: Ends, high: Ends) -> tuple[Ends, Ends]:
        least, most = np.zeros_like(low), np.zeros_like(high)
        c = coordinates(form, precision, low, high, lengths)
        lit = np.flatnonzero(c.opens)
        if len(lit):
            bottom, top = enclosed(body, c.low[lit], c.high[lit], precision)
            shut = c.closes[lit]
            least[lit] = np.where(shut, np.minimum(bottom, 0.0), bottom)
            most[lit] = np.where(shut, np.maximum(top, 0.0), top)
        return least, most

    return values


def _body(spec: Approximation, setting: Setting, precision: Precision) -> Callable[[Any], Any]:
    """The kernel with its coefficients and table as the precision holds them."""
    values: dict[str, Any] = dict(spec.coefficients(setting))
    for name in spec.scalars:
        values[name] = float(precision.constant(values[name]))
    if spec.table is not None:
        values["table"] = [float(entry) for entry in precision.rounded(spec.table(setting))]
    return lambda coordinate: spec.kernel(coordinate, **values)


def _cut(low: Ends, high: Ends, cuts: int) -> tuple[Ends, Ends]:
    shares = np.arange(cuts + 1) / cuts
    edges = low[:, None] + (high - low)[:, None] * shares
    edges[:, -1] = high
    return edges[:, :-1].ravel(), edges[:, 1:].ravel()
