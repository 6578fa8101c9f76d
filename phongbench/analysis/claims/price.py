"""The cost of normalising as part of a verdict: advice to leave it out is worth something only where that is faster."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby

from phongbench.analysis.claims.claim import CONDITIONS, HOLDS, Finding
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import sentence
from phongbench.analysis.normalising_cost import TARGET, Race, in_words, races, timing_rows
from phongbench.analysis.rows import Rows


def priced(finding: Finding, rows: Rows, pairs: Iterable[tuple[str, str]]) -> Finding:
    """The finding with what its advice saves in time, on the target and in the working sets where both were timed.

    pairs  the formula that follows the advice, and the one that it should save time against
    A claim that holds by its errors holds under conditions only, unless each first formula is surely faster in each
    working set. Where nothing was timed, or identical code differed in time, the finding stays as it is.
    """
    raced = [] if rows.twin_differs else races(rows, pairs)
    if not raced:
        return finding
    worth = all(race.verdict == "faster" for race in raced)
    return replace(
        finding,
        verdict=finding.verdict if worth or finding.verdict != HOLDS else CONDITIONS,
        because=f"{finding.because} {told(raced)}",
        conditions=(*finding.conditions, *(race.as_dict() for race in raced)),
        evidence=(*finding.evidence, *evidence("timing", "ratio", timing_rows(rows, raced))),
        coverage=f"{finding.coverage}, timed",
    )


def told(raced: list[Race]) -> str:
    """The races as a sentence that names the target."""
    by_pair = groupby(raced, key=lambda race: (race.one, race.other))
    listed = "; ".join(in_words(list(mine)) for _, mine in by_pair)
    return sentence(f"on the {TARGET} {listed}", "intervals with 98 %")
