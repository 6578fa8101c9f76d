"""Claim i: far away, L.N and V.R may be held constant over a polygon."""

import math

import pandas as pd

from phongbench.analysis.claims.claim import HOLDS, VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.words import rounded, sentence
from phongbench.analysis.rows import Rows, at
from phongbench.formulas.citations import HYPERGRAPH

#: in sides of the polygon: a triangle of a hand's breadth, lit and seen from ten steps away
FAR = 100.0


def judge(rows: Rows) -> Finding:
    """The error of holding L.N, and R.V, constant over a square polygon, as at its middle, while light and viewer move
    away together: the largest over the square, at several angles of incidence, with the viewer on the lobe's peak and
    flanks, at full strength. Far enough is the distance, in sides of the square, from which the error measures at most
    1/255, interpolated between measured distances along a power law. Holds if 100 sides are far enough for the diffuse
    term and the specular term of every measured exponent; holds under conditions if some measured distance is far
    enough for some term; else fails.
    """
    cells = rows.far
    if cells.empty:
        raise LackingRowsError(
            "how far is far enough shows on polygons whose light and viewer move away",
            "measure them: phongbench run --scenes",
        )
    records = [_record(mine) for _, mine in cells.groupby(["term", "held", "alpha"], sort=True, dropna=False)]
    judged = [one for one in records if one["term"] == "diffuse" or one["held"] == "both"]
    reached = [one["sides_from"] for one in judged]
    near = [sides is not None and sides <= FAR for sides in reached]
    verdict = grade(all(near), any(sides is not None for sides in reached))
    deciding = at(cells, held="both") if verdict != HOLDS else cells
    return Finding(verdict, sentence(*map(_sentence, judged)), tuple(records), evidence("far", "max_abs", deciding))


def far_enough(distances: pd.Series, errors: pd.Series) -> float | None:
    """The distance from which the errors measure at most 1/255; the first if all do, None if the last does not."""
    points = sorted(zip(map(float, distances), map(float, errors), strict=True))
    beyond = [n for n, (_, error) in enumerate(points) if not error <= VISIBLE]
    if not beyond:
        return points[0][0]
    if beyond[-1] == len(points) - 1:
        return None
    (near, large), (far, small) = points[beyond[-1]], points[beyond[-1] + 1]
    if small <= 0:
        return far
    share = math.log(large / VISIBLE) / math.log(large / small)
    return float(near * (far / near) ** share)


def _record(mine: pd.DataFrame) -> Record:
    """One term, of one exponent, with the same directions held: its rows over all distances, the nearest first."""
    worst = mine.iloc[-1]
    alpha = None if pd.isna(worst["alpha"]) else float(worst["alpha"])
    return {
        "term": str(worst["term"]),
        "held": str(worst["held"]),
        "alpha": alpha,
        "max_error": VISIBLE,
        "sides_from": far_enough(mine["distance"], mine["max_abs"]),
        "error_times_sides": float(worst["max_abs"] * worst["distance"]),
    }


def _sentence(one: Record) -> str:
    name = "L.N" if one["term"] == "diffuse" else f"R.V at alpha {one['alpha']:g}"
    if one["sides_from"] is None:
        return f"{name}: no measured distance is far enough"
    return f"{name}: far enough from {rounded(one['sides_from'])} sides on"


CLAIM = Claim(
    "i", "With light and viewer far away, L.N and V.R may be held constant over a polygon", HYPERGRAPH, judge, ("far",)
)
