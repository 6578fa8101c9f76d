"""Claim h: a few multiplications replace a power, also where vectors must be normalised for both."""

import pandas as pd

from phongbench.analysis.claims.claim import Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.price import told
from phongbench.analysis.claims.quiet_times import FASTER, PLACES, quiet
from phongbench.analysis.claims.target_prices import OnTargets
from phongbench.analysis.claims.words import listed, sentence, times
from phongbench.analysis.normalising_cost import Race, races, timing_rows
from phongbench.analysis.rows import Rows, at, forms_of, near_gamma
from phongbench.formulas.citations import WIKIPEDIA_PHONG
from phongbench.results.schema import BASELINE, LIBM

#: the larger gamma of the textbooks, or the timed one nearest to it
GAMMA = 8
#: the row of an exact power -> what it is called
ENGINES = {BASELINE: "the vectorised power", LIBM: "libm's power", "integer-power": "squaring a whole exponent"}
#: how sure the interval of a ratio is: to another engine, of two ratios; to exact Phong, that which was measured
LEVEL = ("98 %", "99 %")
#: the same with lengths removed on both sides
PRICED = (
    ("lyon:dot:8/once", "phong/once"),
    ("lyon:cross:8/once", "phong/once"),
    ("lyon:cross:8/each", "phong/each"),
    ("lyon:cross:8@lengthwise/once", "phong@lengthwise/once"),
)


def judge(rows: Rows) -> Finding:
    """Lyon's formula, gamma 8, from vectors to values on one thread, against three engines of the exact power in each
    working set: a vectorised power, the power of the C library, and square-and-multiply for a whole exponent (50). The
    same against the vectorised power where both remove lengths first: with one root, with two, and from N, L and V. The
    interval of a ratio of two ratios reaches from the least to the largest that both intervals allow; faster if it
    lies below 0.98. Holds if faster in each of these cases; fails if never; else holds under conditions. Where
    identical code differed in time, no claim of speed is made.
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
    raced = races(rows, PRICED)
    faster = [*(one["faster"] for one in records), *map(_faster, raced)]
    verdict = grade(all(faster), any(faster))
    decisive = at(pd.concat([lyon, engines]), working_set=records[0]["working_set"])
    shown = (*evidence("timing", "ratio", decisive), *evidence("timing", "ratio", timing_rows(rows, raced)))
    because = f"{_because(records)} {_with_lengths(raced)}".strip()
    brief = sentence(f"lyon with gamma 8 is surely faster than an exact power in {sum(faster)} of {len(faster)} cases")
    return Finding(verdict, because, (*records, *(race.as_dict() for race in raced)), shown, "timed", brief=brief)


def _faster(race: Race) -> bool:
    return race.ratio_high < FASTER


def _with_lengths(raced: list[Race]) -> str:
    """What is left of it where both remove lengths: the largest and the smallest gain of the first place."""
    if not raced:
        return ""
    here = sorted((r for r in raced if r.working_set == raced[0].working_set), key=lambda r: r.ratio)
    shown = [here[0], here[-1]] if len(here) > 1 else here
    counted = sentence(
        f"with lengths removed on both sides it is surely faster in {sum(map(_faster, raced))} of {len(raced)} cases"
    )
    return f"{told(shown)} {counted}"


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
        f"({times(one['times_faster_low'])} .. {times(one['times_faster_high'])}, {LEVEL[one['engine'] == BASELINE]})"
        for one in records
        if (one["working_set"], one["lambda_form"]) == (place, form)
    ]
    parts = [f"lyon, {form}, gamma {records[0]['gamma']} in {place} is {listed(gains)}"]
    places = {where: [one["faster"] for one in records if one["working_set"] == where] for where in PLACES}
    counts = [f"{sum(here)} of {len(here)} in {where}" for where, here in places.items() if here]
    return sentence(*parts, f"over all forms and engines it is surely faster in {listed(counts)}")


CLAIM = Claim(
    "h",
    "A few multiplications replace a variable exponentiation",
    WIKIPEDIA_PHONG,
    judge,
    ("timing", "costs"),
    "speed",
    OnTargets((("lyon:dot:8", "phong"), ("lyon:dot:8/once", "phong/once"))),
)
