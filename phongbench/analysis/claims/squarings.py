"""Claim h: a few multiplications replace a power."""

import pandas as pd

from phongbench.analysis.claims.claim import Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.quiet_times import FASTER, PLACES, quiet
from phongbench.analysis.claims.words import listed, sentence, times
from phongbench.analysis.rows import Rows, at, forms_of, near_gamma
from phongbench.formulas.citations import WIKIPEDIA_PHONG
from phongbench.results.schema import BASELINE, LIBM

#: the larger gamma of the textbooks, or the timed one nearest to it
GAMMA = 8
#: the row of an exact power -> what it is called
ENGINES = {BASELINE: "the vectorised power", LIBM: "libm's power", "integer-power": "squaring a whole exponent"}


def judge(rows: Rows) -> Finding:
    """Lyon's formula, gamma 8, from vectors to values on one thread, against three engines of the exact power in each
    working set: a vectorised power, the power of the C library, and square-and-multiply for a whole exponent (50). The
    interval of a ratio of two ratios reaches from the least to the largest that both intervals allow; faster if it
    lies below 0.98. Holds if faster in each lambda form than each engine in each working set; fails if never; else
    holds under conditions. Where identical code differed in time, no claim of speed is made.
    """
    quiet(rows)
    lyon = near_gamma(at(rows.judged_times, approximation="lyon", space="reflect"), GAMMA)
    engines = at(rows.judged_times, approximation=tuple(ENGINES))
    records = [
        _record(mine, exact)
        for place in PLACES
        for form in forms_of(lyon)
        for engine in ENGINES
        for mine in _rows(at(lyon, working_set=place, lambda_form=form))
        for exact in _rows(at(engines, working_set=place, approximation=engine))
    ]
    if not records:
        raise LackingRowsError(
            "the run has no times of lyon and of an exact power",
            "time them: phongbench run without --no-timing, with lyon among --only",
        )
    faster = [one["faster"] for one in records]
    verdict = grade(all(faster), any(faster))
    decisive = at(pd.concat([lyon, engines]), working_set=records[0]["working_set"])
    return Finding(verdict, _because(records), tuple(records), evidence("timing", "ratio", decisive), "timed")


def _rows(frame: pd.DataFrame) -> list[pd.Series]:
    return [row for _, row in frame.head(1).iterrows()]


def _record(mine: pd.Series, exact: pd.Series) -> Record:
    """How many times faster than an engine; against the baseline the interval is the measured one."""
    base = exact["approximation"] == BASELINE
    high = mine["ratio_high"] / (1.0 if base else exact["ratio_low"])
    low = mine["ratio_low"] / (1.0 if base else exact["ratio_high"])
    return {
        "engine": str(exact["approximation"]),
        "working_set": str(mine["working_set"]),
        "lambda_form": str(mine["lambda_form"]),
        "gamma": int(mine["gamma"]),
        "times_faster": float(exact["ratio"] / mine["ratio"]),
        "times_faster_low": float(1.0 / high),
        "times_faster_high": float(1.0 / low),
        "faster": bool(high < FASTER),
    }


def _because(records: list[Record]) -> str:
    place, form = records[0]["working_set"], records[0]["lambda_form"]
    gains = [
        f"{times(one['times_faster'])} times as fast as {ENGINES[one['engine']]} "
        f"({times(one['times_faster_low'])} .. {times(one['times_faster_high'])})"
        for one in records
        if (one["working_set"], one["lambda_form"]) == (place, form)
    ]
    parts = [f"lyon, {form}, gamma {records[0]['gamma']} in {place} is {listed(gains)}"]
    places = {where: [one["faster"] for one in records if one["working_set"] == where] for where in PLACES}
    counts = [f"{sum(here)} of {len(here)} in {where}" for where, here in places.items() if here]
    return sentence(*parts, f"over all forms and engines it is surely faster in {listed(counts)}")


CLAIM = Claim(
    "h", "A few multiplications replace a variable exponentiation", WIKIPEDIA_PHONG, judge, ("timing",), "speed"
)
