"""Claim g: Blinn's exponent alpha' must be larger than alpha."""

import math

import numpy as np
import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import coverage, evidence
from phongbench.analysis.claims.words import codes, exponents, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.approximations.blinn import RATIOS
from phongbench.formulas.citations import WIKIPEDIA_BLINN

#: incidence angles, in degrees, at which the ratio off the plane of incidence is stated
INCIDENCES = (0.0, 45.0, 60.0, 80.0)


def judge(rows: Rows) -> Finding:
    """Blinn's (N.H)^alpha' against Phong on the highlight of coplanar unit vectors, for each ratio alpha' / alpha that
    was measured. The claim is confirmed at an exponent if the ratio with the least error there is above 1, and that
    error is below what alpha' = alpha errs by (largest difference of the two formulas, on a grid). It holds under
    conditions if confirmed at some exponent, since it cannot hold everywhere: for a normal tilted out of the plane of
    incidence the ratio that fits is 4 cos^2 of the incidence angle by geometry, not above 1 from 60 degrees on. Else it
    fails.
    """
    cells = at(rows.largest_errors, approximation="blinn", space="half", beta_policy=tuple(RATIOS))
    if cells.empty:
        raise LackingRowsError("the run has no rows of blinn", "measure them: phongbench run, or with --only blinn")
    records = tuple(_record(at(cells, alpha=alpha)) for alpha in sorted(cells["alpha"].unique()))
    good = [one["alpha"] for one in records if one["confirmed"]]
    verdict = grade(False, good, len(good) / len(records))
    lifted = tuple(
        {"pairs": "off the plane of incidence", "incidence_degrees": i, "ratio": off_plane(i), "coverage": "law"}
        for i in INCIDENCES
    )
    return Finding(verdict, _because(records, cells, good), records + lifted, _rows(cells), coverage(cells))


def equal_exponent_error(alpha: float) -> float:
    """Largest |cos(t)^alpha - cos(t/2)^alpha| over 0 <= t <= 90 degrees; tends to 0.4725 for large alpha."""
    cosine = 1.0 - np.linspace(0.0, min(1.0, 24.0 / alpha), 4001)
    return float(np.abs(cosine**alpha - ((1.0 + cosine) / 2.0) ** (alpha / 2.0)).max())


def off_plane(incidence_degrees: float) -> float:
    """alpha' / alpha that fits for a normal tilted a little out of the plane of L and V: 4 cos^2 of the incidence.

    With tilt p, R.V = 1 - 2 cos^2(i) sin^2(p) and N.H = cos(p): the deficits are in the ratio 4 cos^2(i).
    """
    return round(4.0 * math.cos(math.radians(incidence_degrees)) ** 2, 12)


def _record(mine: pd.DataFrame) -> Record:
    alpha = float(mine["alpha"].iloc[0])
    best = mine.sort_values(["max_abs", "beta_policy"], kind="stable").iloc[0]
    ratio, equal = RATIOS[str(best["beta_policy"])](alpha), equal_exponent_error(alpha)
    tried = {str(row["beta_policy"]): float(row["max_abs"]) for _, row in mine.iterrows()}
    return {
        "pairs": "coplanar",
        "alpha": alpha,
        "best_policy": str(best["beta_policy"]),
        "ratio": float(ratio),
        "max_error": float(best["max_abs"]),
        "ratio_4_error": tried.get("taylor"),
        "ratio_1_error": equal,
        "confirmed": bool(ratio > 1.0 and best["max_abs"] < equal),
    }


def _because(records: tuple[Record, ...], cells: pd.DataFrame, good: list[float]) -> str:
    measured = [one["alpha"] for one in records]
    first, last = records[0], records[-1]
    parts = [
        f"on coplanar vectors alpha' > alpha is confirmed at {exponents(good, measured)}",
        f"of the measured ratios, {_least(first)} and {_least(last)} err least",
        f"alpha' = alpha would err by {codes(last['ratio_1_error'])}",
    ]
    plain = [one["alpha"] for one in records if (one["ratio_4_error"] or math.inf) <= VISIBLE]
    if "taylor" in set(cells["beta_policy"]):
        parts.append(f"the usual ratio of 4 measures at most 1/255 at {exponents(plain, measured)}")
    parts.append("off the plane of incidence the ratio that fits falls to 1 at 60 degrees of incidence, by geometry")
    return sentence(*parts)


def _least(one: Record) -> str:
    return f"{one['ratio']:.4g} at alpha {one['alpha']:g} ({codes(one['max_error'])})"


def _rows(cells: pd.DataFrame) -> tuple[Record, ...]:
    ends = (cells["alpha"].min(), cells["alpha"].max())
    return evidence("accuracy", "max_abs", at(cells, alpha=ends))


CLAIM = Claim(
    "g",
    "The exponent alpha' of (N.H) must be larger than Phong's alpha to look alike",
    WIKIPEDIA_BLINN,
    judge,
    ("accuracy",),
    across=("alphas",),
)
