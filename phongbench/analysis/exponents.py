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
    def of(asked: "Exponents | float | str") -> "Exponents":
        """`50`, `10,50,200` or `10..200` as text, or a plain number; InputError for anything else."""
        if isinstance(asked, Exponents):
            return asked
        text = f"{asked:.17g}" if isinstance(asked, int | float) else asked
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
            found = [k for k in known if low * (1 - _CLOSE) <= k <= high * (1 + _CLOSE)]
            if not found:
                raise _unmeasured(str(self), known)
            return tuple(found)
        return tuple(_only(_same(value, known), value, known) for value in self.values)

    def around(self, known: Iterable[float]) -> tuple[float, ...] | None:
        """The known exponents that vouch for those asked about; None where one lies outside all known ones.

        An exponent that is not known itself is vouched for by its two neighbours: every model error falls to its zero
        and rises again as alpha grows, so between two exponents it is at most the larger of theirs.
        """
        known = sorted({float(k) for k in known})
        found: set[float] = set()
        for value in self.values:
            same = _same(value, known)
            below, above = [k for k in known if k < value], [k for k in known if k > value]
            if same is None and not (below and above):
                return None
            found |= {same} if same is not None else {below[-1], above[0]}
        if self.continuous:
            found |= {k for k in known if self.values[0] <= k <= self.values[-1]}
        return tuple(sorted(found))


def _exponent(word: str, text: str) -> float:
    if not re.fullmatch(r"\s*\d+(\.\d*)?(e[+-]?\d+)?\s*", word, re.IGNORECASE):
        raise InputError(f"{text!r} is not an exponent, a list or a range of them", "alpha", _MEND)
    value = float(word)
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"alpha = {word.strip()} is not above 0 and finite", "alpha", _MEND)
    return value


def _same(value: float, known: Iterable[float]) -> float | None:
    return next((k for k in known if abs(k - value) <= _CLOSE * value), None)


def _only(found: float | None, value: float, known: Iterable[float]) -> float:
    if found is None:
        raise _unmeasured(f"{value:g}", known)
    return found


def _unmeasured(asked: str, known: Iterable[float]) -> InputError:
    listed, wanted = ", ".join(f"{k:g}" for k in known), asked.replace(" .. ", ",")
    fix = f"known: {listed}; measure it: phongbench run --alpha {wanted}"
    return InputError(f"alpha {asked} was not measured", None, fix)
