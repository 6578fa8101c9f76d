"""Claim o: Phong's highlight is cut off where R.V passes 90 degrees; a power of N.H is not."""

import math

import pandas as pd

from phongbench.analysis.claims.claim import FAILS, VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import codes, sentence
from phongbench.analysis.rows import Rows, at, ordered
from phongbench.formulas.citations import WIKIPEDIA_BLINN

#: an exponent is small up to here
SMALL = 1.0


def judge(rows: Rows) -> Finding:
    """The value of max(0, R.V)^alpha one degree in front of the angle from which it is 0, and of (N.H)^(4 alpha)
    likewise, in the plane of incidence. Phong is visibly cut at an exponent if that step exceeds 1/255. Holds if it is
    visibly cut at every measured exponent above 0 and up to 1, while N.H is 0 nowhere below 180 degrees between R and
    V, which lie under the horizon; holds under conditions if it is at some of these exponents; fails if at none, or if
    N.H is cut too. The largest exponent with a visible cut is ln 255 / -ln sin 1 degree. Other formulas are cut where
    the test of a.b > 0 ends them: for each, the largest measured exponent at which that shows.
    """
    cells = rows.cuts
    phong, blinn = at(cells, approximation="phong"), at(cells, approximation="blinn")
    small = phong[(phong["alpha"] > 0) & (phong["alpha"] <= SMALL)]
    if small.empty or blinn.empty:
        raise LackingRowsError(
            "where lobes are cut off was not looked for at small exponents, of Phong and of a power of N.H",
            "measure it: phongbench run --probe lobes",
        )
    seen = small["step"] > VISIBLE
    verdict = FAILS if blinn["cut_degrees"].notna().any() else grade(seen.all(), seen.any())
    first, last = (small.iloc[n] for n in (0, -1))
    beside = float(at(blinn, alpha=float(last["alpha"]))["at_90"].max())
    others = _others(cells)
    because = sentence(
        f"Phong falls to 0 at {first['cut_degrees']:g} degrees, within the last degree by {codes(first['step'])} at "
        f"alpha {first['alpha']:g} and {codes(last['step'])} at {last['alpha']:g}; it shows up to alpha "
        f"{reach():.3g}",
        f"N.H to 4 alpha is not cut: at {first['cut_degrees']:g} degrees it is still {beside:.2g} at alpha "
        f"{last['alpha']:g}",
        _worst(others),
    )
    records = (*(_record(row) for _, row in phong.iterrows()), *others)
    return Finding(verdict, because, records, evidence("cuts", "step", small), "law")


def reach() -> float:
    """The exponent up to which Phong exceeds 1/255 a degree in front of R.V = 0: sin(1 degree)^alpha = 1/255."""
    return math.log(VISIBLE) / math.log(math.sin(math.radians(1.0)))


def _record(row: pd.Series) -> Record:
    return {name: float(row[name]) for name in ("alpha", "cut_degrees", "step", "codes")}


def _others(cells: pd.DataFrame) -> list[Record]:
    """For each further formula of (R, V) cut at 90 degrees with a visible step: the largest exponent where it is."""
    cut = cells[(cells["approximation"] != "phong") & (cells["cut_degrees"] == 90) & (cells["step"] > VISIBLE)]
    last = cut.sort_values("alpha", kind="stable").drop_duplicates(["approximation", "gamma", "space"], keep="last")
    return [
        {
            "approximation": str(row["approximation"]),
            "gamma": None if pd.isna(row["gamma"]) else int(row["gamma"]),
            "alpha_to": float(row["alpha"]),
            "step": float(row["step"]),
        }
        for _, row in ordered(last, ["approximation", "gamma"]).iterrows()
    ]


def _worst(others: list[Record]) -> str:
    if not others:
        return ""
    worst = max(others, key=lambda one: (one["alpha_to"], one["step"]))
    gamma = "" if worst["gamma"] is None else f" with gamma {worst['gamma']}"
    return (
        f"the test of a.b > 0 cuts approximations harder: {worst['approximation']}{gamma} by "
        f"{codes(worst['step'])} at alpha {worst['alpha_to']:g}"
    )


CLAIM = Claim(
    "o",
    "Phong's highlight is cut off where R.V passes 90 degrees, which shows at small exponents; a power of N.H is not",
    WIKIPEDIA_BLINN,
    judge,
    ("cuts",),
    "cut",
)
