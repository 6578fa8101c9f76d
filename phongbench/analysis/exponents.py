"""Which exponents a question is about: one, several, or all between two."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from phongbench.errors import InputError

_MEND = "write 50, or 10,50,200, or 10..200"
_CLOSE = 1e-9


@dataclass(frozen=True, slots=True)
class Exponents:
    """The exponents asked about.

    values      distinct and ascending; the two ends of a range
    continuous  True for a range: every exponent between its ends is meant, whole or not
    """

    values: tuple[float, ...]
    continuous: bool = False

    @staticmethod
    def of(requested: "Exponents | float | str") -> "Exponents":
        """`50`, `10,50,200` or `10..200` as text, or a plain number; InputError for anything else."""
        if isinstance(requested, Exponents):
            return requested
        text = f"{requested:.17g}" if isinstance(requested, int | float) else requested
        words, ends = text.split(","), text.split("..")
        continuous = len(ends) == 2
        values = sorted({_exponent(word, text) for word in (ends if continuous else words)})
        return Exponents(tuple(values), continuous and len(values) == 2)

    def __str__(self) -> str:
        return (" .. " if self.continuous else ", ").join(f"{value:.10g}" for value in self.values)

    def measured(self, known: Iterable[float]) -> tuple[float, ...]:
        """The known exponents that are asked about: the listed ones, or those within the range.

        InputError lists the known ones where one of a list, or any of a range, is missing.
        """
        known = sorted({float(k) for k in known})
        low, high = self.values[0], self.values[-1]
        if self.continuous:
            chosen = [k for k in known if low * (1 - _CLOSE) <= k <= high * (1 + _CLOSE)]
            if not chosen:
                raise _unmeasured([str(self)], known)
            return tuple(chosen)
        missing = [f"{value:.10g}" for value in self.values if _same(value, known) is None]
        if missing:
            raise _unmeasured(missing, known)
        return tuple(k for value in self.values for k in [_same(value, known)] if k is not None)

    def around(self, known: Iterable[float]) -> tuple[float, ...] | None:
        """The known exponents that vouch for those asked about; None where one lies outside all known ones.

        An exponent that is not known itself is vouched for by its two neighbours: every model error falls to its zero
        and rises again as alpha grows, so between two exponents it is at most the larger of theirs.
        """
        known = sorted({float(k) for k in known})
        chosen: set[float] = set()
        for value in self.values:
            same = _same(value, known)
            below, above = [k for k in known if k < value], [k for k in known if k > value]
            if same is None and not (below and above):
                return None
            chosen |= {same} if same is not None else {below[-1], above[0]}
        if self.continuous:
            chosen |= {k for k in known if self.values[0] <= k <= self.values[-1]}
        return tuple(sorted(chosen))


def _exponent(word: str, text: str) -> float:
    if not re.fullmatch(r"\s*\d+(\.\d*)?(e[+-]?\d+)?\s*", word, re.IGNORECASE):
        raise InputError(f"{text!r} is not an exponent, a list or a range of them", "alpha", _MEND)
    value = float(word)
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"alpha = {word.strip()} is not above 0 and finite", "alpha", _MEND)
    return value


def _same(value: float, known: Iterable[float]) -> float | None:
    return next((k for k in known if abs(k - value) <= _CLOSE * value), None)


def _unmeasured(missing: list[str], known: Iterable[float]) -> InputError:
    listed, wanted = ", ".join(f"{k:g}" for k in known), ",".join(missing).replace(" .. ", ",")
    fix = f"known: {listed}; measure it: phongbench run --alpha {wanted}"
    verb = "was" if len(missing) == 1 else "were"
    return InputError(f"alpha {' and '.join(missing)} {verb} not measured", None, fix)
