"""Claim f: Blinn-Phong is cheaper with viewer and light at infinity."""

import pandas as pd

from phongbench.analysis.claims.claim import UNMEASURED, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.price import priced
from phongbench.analysis.claims.quiet_times import FASTER, PLACES, quiet
from phongbench.analysis.claims.target_prices import OnTargets
from phongbench.analysis.claims.words import listed, sentence
from phongbench.analysis.normalising_cost import TARGET, Race, in_words, races, timing_rows
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.citations import WIKIPEDIA_BLINN
from phongbench.results.schema import DISTANT
from phongbench.timing import statistics
from phongbench.timing.statistics import Interval

#: with one root for N, Blinn's power and Phong's from a raw N: one H for all; and from raw N, L and V
_BLINN, _PHONG = "blinn@halfway/once", ("phong@reflect", "phong@lengthwise/once")
FROM_RAW, NEAR = [(DISTANT + _BLINN, DISTANT + name) for name in _PHONG], [(_BLINN, name) for name in _PHONG]


def judge(rows: Rows) -> Finding:
    """Shading a surface by (N.H)^(4 alpha), a highlight of the same width, over shading it by (R.V)^alpha: with light
    and viewer at infinity, where one H serves all points, and with both near; with the exact power, and with Lyon's few
    squarings in its place. Certainly faster: the whole interval of the ratio below 1, the ratio below 0.98. Holds if
    so at infinity for every measured exponent and both powers; holds under conditions if for some; else fails. Withheld
    if the same code timed twice differed. With normalising priced: from a raw N, H made once, against each way from
    that N to R.V; unless that, too, is faster beyond doubt, it holds under conditions at most. Without times of shading
    those from a raw N decide by the same rule; without these, what a run says of (N, H) once given is told.
    """
    shaded = at(rows.scene_times, kind="shading")
    if shaded.empty:
        return _from_raw(rows) or _once_given(rows)
    if rows.twin_differs:
        quiet(rows)
    twins = at(shaded, name="phong again")
    if any(_verdict(row) != "unresolved" for _, row in twins.iterrows()):
        raise LackingRowsError(
            "identical shading differed in time, so its speed claims are withheld",
            "time it again on a quiet machine: phongbench run --scenes",
        )
    blinn = at(shaded, name="blinn-phong")
    records = tuple(_shaded(row) for _, row in blinn.iterrows())
    far = [one for one in records if one["light_and_viewer"] == "infinity"]
    faster = [one for one in far if one["ratio_high"] < 1 and one["ratio_to_phong"] < FASTER]
    verdict = grade(len(faster) == len(far), faster)
    parts = [
        f"with {power}, (N.H)^alpha' takes {_range(records, power, 'infinity')} of the time of (R.V)^alpha at "
        f"infinity, {_range(records, power, 'near')} near"
        for power in dict.fromkeys(one["power"] for one in records)
    ]
    certain = f"certainly faster at infinity in {len(faster)} of {len(far)} cases"
    found = Finding(verdict, sentence(*parts, certain), records, evidence("scene_times", "ratio", blinn), "timed")
    return priced(found, rows, FROM_RAW)


def _from_raw(rows: Rows) -> Finding | None:
    """The verdict by times of kernels that are given a raw N, light and viewer at infinity; None without any."""
    raced = races(rows, FROM_RAW)
    if not raced:
        return None
    quiet(rows)
    faster = [race for race in raced if race.ratio_high < 1 and race.ratio < FASTER]
    near = races(rows, NEAR)
    parts = [f"on the {TARGET}, light and viewer at infinity, from a raw N {_each(raced)}"]
    parts += [f"both near, from raw N, L and V {_each(near)}"] if near else []
    records = tuple(race.as_dict() for race in (*raced, *near))
    shown = evidence("timing", "ratio", timing_rows(rows, [*raced, *near]))
    verdict = grade(len(faster) == len(raced), faster)
    brief = f"from a raw N, light and viewer at infinity, Blinn is surely faster in {len(faster)} of {len(raced)} cases"
    because = sentence(*parts, "intervals with 98 %")
    return Finding(verdict, because, records, shown, "timed", brief=sentence(brief))


def _each(raced: list[Race]) -> str:
    return listed(in_words([race]) for race in raced)


def _verdict(row: pd.Series) -> str:
    return statistics.verdict(Interval(float(row["ratio"]), float(row["ratio_low"]), float(row["ratio_high"])))


def _shaded(row: pd.Series) -> Record:
    return {
        "power": "the exact power" if row["formula"] == "phong" else str(row["formula"]),
        "light_and_viewer": str(row["scene"]),
        "alpha": float(row["setting"]),
        "ratio_to_phong": float(row["ratio"]),
        "ratio_low": float(row["ratio_low"]),
        "ratio_high": float(row["ratio_high"]),
    }


def _range(records: tuple[Record, ...], power: str, place: str) -> str:
    """The ratios of all exponents: "0.91 .. 0.93"."""
    ordered = sorted(o["ratio_to_phong"] for o in records if (o["power"], o["light_and_viewer"]) == (power, place))
    ends = list(dict.fromkeys(f"{value:.3g}" for value in (ordered[:1] + ordered[-1:])))
    return " .. ".join(ends) or "no measured share"


def _once_given(rows: Rows) -> Finding:
    """What times of kernels say: given (N, H), how long Blinn's power takes over Phong's given (R, V)."""
    times = at(rows.judged_times, approximation="blinn", space="half") if len(rows.timing) else rows.timing
    wait = "what making R at every point costs, against one H for all, shows in shaded scenes only"
    fix = "time it: phongbench run --scenes"
    if times.empty or rows.twin_differs:
        quiet(rows)
        raise LackingRowsError(wait, fix)
    here = pd.concat([at(times, working_set=place) for place in PLACES])
    records = tuple(
        {
            "working_set": str(row["working_set"]),
            "ratio_to_phong": float(row["ratio"]),
            "ratio_low": float(row["ratio_low"]),
            "ratio_high": float(row["ratio_high"]),
        }
        for _, row in here.iterrows()
    )
    ratios = [
        f"{one['ratio_to_phong']:.3g} in {one['working_set']} ({one['ratio_low']:.3g} .. {one['ratio_high']:.3g}, 99 %)"
        for one in records
    ]
    because = sentence(f"once the vectors are given, (N.H)^alpha' takes {listed(ratios)} of Phong's time", wait)
    return Finding(UNMEASURED, because, records, evidence("timing", "ratio", here), "timed", fix)


CLAIM = Claim(
    "f",
    "Blinn-Phong is faster where viewer and light are at infinity",
    WIKIPEDIA_BLINN,
    judge,
    ("timing", "scene_times", "costs"),
    "speed",
    # at infinity one H serves all points, and R is made at each; near, H is made at each, too
    OnTargets((("blinn", "phong@reflect"),), (("blinn@halfway/once", "phong@reflect"),)),
)
