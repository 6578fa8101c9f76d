"""A direction of a panel, or of several that share it: what it reaches over, and where its ticks are."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]

#: room beside the data where no limits are set, of what they span
_MARGIN = 0.05
#: steps between ticks of a linear scale, times powers of ten
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


class Scale:
    """Linear until it is made logarithmic.

    log       whether it is logarithmic
    fontsize  of its labels
    """

    def __init__(self) -> None:
        self.log, self.fontsize = False, 9.0
        self._low, self._high, self._least = math.inf, -math.inf, math.inf
        self._ends: set[float] = set()
        self._set: list[float | None] = [None, None]
        self._flipped = False
        self._ticks: list[tuple[float, str]] | None = None
        self._minor: Sequence[float] | None = None
        self._decades: tuple[int, Callable[[float], str]] | None = None

    def reach(self, values: Any, *, ends: Iterable[float] = ()) -> None:
        """Have room for these values, if no limits are set.

        ends  values beyond which no room is left: where bars begin
        """
        known = np.asarray(values, float)
        known = known[np.isfinite(known)]
        self._low, self._high = float(known.min(initial=self._low)), float(known.max(initial=self._high))
        self._least = float(known[known > 0].min(initial=self._least))
        self._ends.update(ends)

    def limit(self, low: float | None, high: float | None) -> None:
        """Set the ends, the first one at the left or at the bottom, or one of them; None leaves an end as it is."""
        self._set = [self._set[0] if low is None else float(low), self._set[1] if high is None else float(high)]

    def flip(self) -> None:
        """Exchange the ends."""
        self._flipped = True

    @property
    def limits(self) -> tuple[float, float]:
        """The ends, the first one at the left or at the bottom."""
        low, high = self._around_data() if None in self._set else (0.0, 1.0)
        first, last = (free if end is None else end for end, free in zip(self._set, (low, high), strict=True))
        return (last, first) if self._flipped else (first, last)

    def _around_data(self) -> tuple[float, float]:
        low, high = self._low, self._high
        if self.log and low <= 0:
            low = self._least
        if not (math.isfinite(low) and math.isfinite(high)):
            return (1.0, 10.0) if self.log else (0.0, 1.0)
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            low, high = (
                (low / 10, high * 10) if self.log else (low - 0.05 * (abs(low) or 1), low + 0.05 * (abs(low) or 1))
            )
        first, last = self._straight(np.array([low, high])).tolist()
        room = _MARGIN * (last - first)
        wide = [10.0 ** (first - room), 10.0 ** (last + room)] if self.log else [first - room, last + room]
        below, above = [e for e in self._ends if e <= low], [e for e in self._ends if e >= high]
        return max([wide[0], *below]), min([wide[1], *above])

    def _straight(self, values: Vector) -> Vector:
        """The values as they are drawn; what a logarithm has no place for is NaN."""
        return np.log10(np.where(values > 0, values, np.nan)) if self.log else values

    def fractions(self, values: Any) -> Vector:
        """Where values lie between the ends, 0 to 1."""
        low, high = self._straight(np.array(self.limits))
        return np.asarray((self._straight(np.asarray(values, float)) - low) / (high - low))

    def by_decades(self, most: int, written: Callable[[float], str]) -> None:
        """Logarithmic: at most so many powers of ten with labels, and small ticks at 2 to 9 where all may have one."""
        self.log, self._decades, self._ticks, self._minor = True, (most, written), None, None

    def name(self, values: Iterable[float], labels: Iterable[str] | None = None) -> None:
        """Ticks at these values, with these labels or the numbers."""
        places = [float(value) for value in values]
        self._ticks = list(zip(places, _numbers(places, places) if labels is None else labels, strict=True))

    def subdivide(self, values: Sequence[float]) -> None:
        """Small ticks without labels at these values."""
        self._minor = values

    def ticks(self, room: int) -> list[tuple[float, str]]:
        """Places and labels of the ticks between the ends.

        room  how many labels there is room for, where the scale chooses
        """
        low, high = sorted(self.limits)
        slack = 1e-9 * (high - low)
        if self._ticks is not None:
            return [(place, label) for place, label in self._ticks if low - slack <= place <= high + slack]
        if self._decades is not None:
            most, written = self._decades
            return [(10.0**power, written(10.0**power)) for power in _decades(low, high, most)]
        places = _round_numbers(low, high, min(max(room, 1), 9))
        return list(zip(places, _numbers(places, [low, high]), strict=True))

    def small_ticks(self) -> list[float]:
        """Places of the ticks without labels."""
        low, high = sorted(self.limits)
        found = self._minor
        if found is None and self._decades is not None:
            powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
            digits = range(2, 10) if self._decades[0] >= 20 else (1,)
            found = [digit * 10.0**power for power in powers for digit in digits]
        return [float(place) for place in found or () if low <= place <= high]


def _decades(low: float, high: float, most: int) -> Sequence[int]:
    """At most so many exponents of powers of ten from `low` to `high`, evenly apart: matplotlib's LogLocator.

    They are multiples of their step where that is as many.
    """
    first, last = math.ceil(math.log10(low) - 1e-12), math.floor(math.log10(high) + 1e-12)
    there = last - first + 1
    if there <= 0:
        return ()
    count = min(math.ceil(there / (there // (most + 1) + 1)), most)
    if count == 1:
        return (round((math.log10(low) + math.log10(high)) / 2),) if there == 1 else (first + there // 2,)
    step = (there - 1) // (count - 1)
    step = step if step >= there / count else there // count
    offset = -first % step
    least, beyond = max(there - step * count, 0), min(there - step * (count - 1), step)
    return range(first + (offset if least <= offset < beyond else least), last + 1, step)


def _round_numbers(low: float, high: float, most: int) -> list[float]:
    """Round numbers from `low` to `high` in at most so many steps: the rule of matplotlib's MaxNLocator."""
    wanted = (high - low) / most
    unit = 10.0 ** math.floor(math.log10(wanted))
    steps = [unit * size * step for size in (0.1, 1.0) for step in _STEPS[:-1]] + [10 * unit, 20 * unit]
    for step in reversed([s for s in steps if s < wanted] + [min(s for s in steps if s >= wanted)]):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last > first:
            return [index * step for index in range(first, last + 1)]
    return []


def _numbers(places: Sequence[float], beside: Sequence[float]) -> list[str]:
    """The places with as few decimals as tell them apart. The rule of matplotlib's ScalarFormatter."""
    if not places:
        return []
    held = [*places, *beside] if len(places) < 5 else places
    span = max(held) - min(held) or abs(held[0]) or 1.0
    order = math.floor(math.log10(span))
    decimals = max(0, 3 - order)
    while decimals and max(abs(p - round(p, decimals - 1)) for p in places) < 10.0 ** (order - 3):
        decimals -= 1
    return [f"{place:.{decimals}f}".replace("-", "\u2212") for place in places]
