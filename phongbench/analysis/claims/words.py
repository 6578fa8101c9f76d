"""Numbers as parts of a sentence."""

import math
import re
from collections.abc import Iterable, Sequence


def listed(words: Iterable[str]) -> str:
    """Words as part of a sentence: "a", "a and b", "a, b and c"; "none" without any."""
    parts = list(words)
    return " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]])) if parts else "none"


def exponents(some: Sequence[float], measured: Sequence[float]) -> str:
    """Some of the measured exponents in words: "alpha 10 and 20", "alpha 100 .. 1000", "every exponent (5 .. 1000)"."""
    if not some:
        return f"none of the {len(measured)} exponents" if len(measured) > 1 else "no measured exponent"
    ends = f"{some[0]:g} .. {some[-1]:g}"
    if len(some) == len(measured) > 1:
        return f"every exponent ({ends})"
    first = list(measured).index(some[0])
    unbroken = list(measured[first : first + len(some)]) == list(some)
    return f"alpha {ends}" if len(some) > 2 and unbroken else f"alpha {listed(f'{alpha:g}' for alpha in some)}"


def codes(error: float) -> str:
    """An error in 8-bit codes."""
    if not math.isfinite(error):
        return "codes without end"
    text = f"{255 * error:.2g}" if 255 * error < 10 else f"{255 * error:.0f}"
    return f"{text} code{'s' * (text != '1')}"


def times(ratio: float) -> str:
    """A ratio to two digits: "3.6", "160"."""
    return f"{float(f'{ratio:.2g}'):g}" if ratio < 1e6 else "over a million"


def rounded(value: float) -> str:
    """A large number to three digits: "63,800"."""
    return f"{float(f'{value:.3g}'):,.0f}"


def percent(part: float) -> str:
    """A share as percent."""
    return f"{100 * part:.3g} %"


def sentence(*parts: str) -> str:
    """Parts joined by semicolons, with a capital and a full stop."""
    text = "; ".join(part for part in parts if part)
    return f"{text[:1].upper()}{text[1:]}."


#: words of a verdict's line, at most
BRIEF = 25


def brief(because: str) -> str:
    """The first clauses of a reason, as many as fit into BRIEF words; what is in brackets is given up first.

    A clause ends in a semicolon or a full stop. Where even the first is too long the rule gives a `brief` of its own.
    """
    clauses = re.split(r"; |\. (?=[A-Z])", because.rstrip("."))
    if len(clauses[0].split()) > BRIEF:
        clauses = [re.sub(r" \([^()]*\)", "", clauses[0])]
    kept = clauses[0]
    for clause in clauses[1:]:
        if len(f"{kept} {clause}".split()) > BRIEF:
            break
        kept = f"{kept}; {clause}"
    return f"{kept}."
