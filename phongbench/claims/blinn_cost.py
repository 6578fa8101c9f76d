"""Claim f: Blinn-Phong is cheaper with viewer and light at infinity."""

from __future__ import annotations

import pandas as pd

from phongbench.claims.claim import SCENES, UNMEASURED, Claim, Finding, LackingRowsError
from phongbench.claims.cuts import Rows, at, evidence
from phongbench.claims.times import PLACES, quiet
from phongbench.claims.words import listed, sentence
from phongbench.sources import WIKIPEDIA_BLINN


def judge(rows: Rows) -> Finding:
    """Needs the time of making the vectors, R at every point against one H for all points, on shaded scenes; until they
    are timed the claim is not measured. What a run's times say already: given (N, H), Blinn's power takes as long as
    Phong's given (R, V), or not, by the interval of their ratio in each working set.
    """
    times = at(rows.timed, approximation="blinn", space="half") if len(rows.timing) else rows.timing
    wait = "what making R at every point costs, against one H for all, shows in shaded scenes only"
    mend = "no run measures it yet: it takes scenes shaded with (R, V) and with one H"
    if times.empty or rows.alarms:
        quiet(rows)
        raise LackingRowsError(wait, None, mend)
    here = pd.concat([at(times, working_set=place) for place in PLACES])
    told = tuple(
        {
            "working_set": str(row["working_set"]), "ratio_to_phong": float(row["ratio"]),
            "ratio_low": float(row["ratio_low"]), "ratio_high": float(row["ratio_high"]),
        }
        for _, row in here.iterrows()
    )  # fmt: skip
    ratios = [
        f"{one['ratio_to_phong']:.3g} in {one['working_set']} ({one['ratio_low']:.3g} .. {one['ratio_high']:.3g})"
        for one in told
    ]
    because = sentence(f"once the vectors are given, (N.H)^alpha' takes {listed(ratios)} of Phong's time", wait)
    return Finding(UNMEASURED, because, told, evidence("timing", "ratio", here), "timed", mend)


CLAIM = Claim(
    "f",
    "Blinn-Phong is faster where viewer and light are at infinity",
    WIKIPEDIA_BLINN,
    judge,
    ("timing", SCENES),
    "speed",
)
