"""Claim d: R and V practically need no normalisation, except on very coarse meshes."""

import itertools
import math
from dataclasses import replace

import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import evidence
from phongbench.analysis.claims.price import priced
from phongbench.analysis.claims.words import exponents, listed, sentence
from phongbench.analysis.mesh_edges import GAMMA, PAIRS, widest_edge
from phongbench.analysis.normalising_cost import FROM_N_L_V, FROM_PAIR
from phongbench.analysis.rows import FORMS, Rows, at, near_gamma
from phongbench.formulas.citations import WIKIPEDIA_PHONG
from phongbench.results.schema import MESHES

#: edges of 10 degrees: a sphere of 36 segments around. What is coarser is called very coarse
COARSE = 10.0
#: the form, and the way to R, that the textbooks mean
MEANT = {"lambda_form": "cross", "pair": "classic"}
#: what a record is made from, its key first
_READ = ["pair", "lambda_form", "alpha", "gamma", "edge_degrees", "length_max"]
_WAYS = {"classic": "classic R", "lengthwise": "lengthwise R", "half": "(N, H)"}


def judge(rows: Rows) -> Finding:
    """What normals that were interpolated over triangles and not made unit again change in Lyon's formula, slope
    alpha / gamma, gamma 8, against the same formula on renormalised ones: R as 2 (L.N) N - L (classic), as
    2 (N.L) N - (N.N) L (lengthwise), and (N, H). Good enough up to an edge angle: a change of at most 1/255 on every
    mesh, interpolated between measured angles along a power law. Judged in the cross form with classic R. Holds if
    good enough up to edges of 10 degrees at every measured exponent, which spares very coarse meshes only, and, where
    timed, surely faster than exact Phong with one root, given R and V and from N, L and V; holds under conditions if
    good enough at some exponent, or if smaller edges, another form or another way are; else fails.
    """
    cells = _source(rows)
    parts = dict(list(cells[_READ].groupby(_READ[:3], observed=True)))
    records = [
        _record(parts[key]) for key in itertools.product(PAIRS, FORMS, sorted(cells["alpha"].unique())) if key in parts
    ]
    judged = [one for one in records if all(one[k] == v for k, v in MEANT.items())]
    fine = [one["alpha"] for one in judged if (one["edge_degrees_to"] or 0.0) >= COARSE]
    some = any(one["edge_degrees_to"] is not None for one in records)
    open_ = [one for one in judged if one["beyond_measured"] and one["alpha"] not in fine]  # how far is not known
    verdict = grade(judged and len(fine) == len(judged), some, (len(fine) + len(open_)) / max(len(judged), 1))
    found = Finding(verdict, _because(judged or records, records, fine), tuple(records), _rows(cells), "sampled")
    return priced(replace(found, brief=_brief(judged, fine)), rows, [FROM_PAIR, FROM_N_L_V])


def _brief(judged: list[Record], fine: list[float]) -> str | None:
    """At how many exponents edges may be coarse, by the way that is meant; None where it was not measured."""
    said = f"up to edges of {COARSE:g} degrees raw normals change the cross form with classic R by at most one code"
    return sentence(f"{said} at {len(fine)} of {len(judged)} exponents") if judged else None


def _source(rows: Rows) -> pd.DataFrame:
    cells = rows.judged_meshes
    if len(cells):
        wanted = {"approximation": "lyon", "beta_policy": "taylor", "truth": "interpolated", "normals": "raw"}
        cells = near_gamma(at(cells, pair=PAIRS, **wanted), GAMMA)
    if cells.empty:
        raise LackingRowsError(
            "the run has no rows on interpolated normals of meshes",
            "measure them: phongbench run --probe meshes, with lyon among --only and an alpha of 10 .. 1024",
        )
    return cells


def _record(mine: pd.DataFrame) -> Record:
    angles = mine["edge_degrees"].astype(float).tolist()
    change = mine["length_max"].astype(float).fillna(math.inf).tolist()
    (one, way), (two, way_two) = (widest_edge(angles, change, limit) for limit in (VISIBLE, 2 * VISIBLE))
    first = mine.iloc[0]
    return {
        "pair": str(first["pair"]),
        "lambda_form": str(first["lambda_form"]),
        "alpha": float(first["alpha"]),
        "gamma": int(first["gamma"]),
        "max_change": VISIBLE,
        "edge_degrees_to": None if way == "<" else one,
        "beyond_measured": way == ">",
        "edge_degrees_to_two_codes": None if way_two == "<" else two,
        "largest_change": max(change),
        "edge_degrees_measured_from": min(angles),
        "edge_degrees_measured_to": max(angles),
    }


def _because(judged: list[Record], records: list[Record], fine: list[float]) -> str:
    first, last = judged[0], judged[-1]
    way = f"in the {first['lambda_form']} form with {_WAYS[first['pair']]}, gamma {first['gamma']}"
    where = exponents(fine, [one["alpha"] for one in judged])
    parts = [f"{way}, raw normals change at most one code up to edges of {COARSE:g} degrees at {where}"]
    parts.append("they do so up to " + listed(dict.fromkeys((_far(first), _far(last)))))
    for pair in dict.fromkeys(one["pair"] for one in records if one["pair"] != first["pair"]):
        here = [one for one in records if (one["pair"], one["alpha"]) == (pair, last["alpha"])]
        best = max(here, key=lambda one: (one["edge_degrees_to"] or 0.0, -one["largest_change"]), default=None)
        if best is not None:
            parts.append(f"with {_WAYS[pair]}, the {best['lambda_form']} form does up to {_far(best)}")
    return sentence(*parts)


def _far(one: Record) -> str:
    angle = one["edge_degrees_to"]
    more = "more than " if one["beyond_measured"] else ""
    return f"{'no measured edge' if angle is None else f'{more}{angle:.2g} degrees'} at alpha {one['alpha']:g}"


def _rows(cells: pd.DataFrame) -> tuple[Record, ...]:
    """The finest edges that are too wide, for the smallest and the largest exponent that has any; else the widest."""
    judged = at(cells, **MEANT)
    judged = judged if len(judged) else cells
    bad = judged[~(judged["length_max"] <= VISIBLE)]
    order = ["edge_degrees", "length_max", *MESHES.key]
    if bad.empty:
        return evidence("meshes", "length_max", judged.sort_values(order, kind="stable").tail(1))
    kept = bad.sort_values(order, kind="stable").drop_duplicates("alpha")
    kept = kept[kept["alpha"].isin([kept["alpha"].min(), kept["alpha"].max()])]
    return evidence("meshes", "length_max", kept.sort_values("alpha", kind="stable"))


CLAIM = Claim(
    "d",
    "R and V practically need not be normalised, except on very coarse meshes",
    WIKIPEDIA_PHONG,
    judge,
    ("meshes", "timing"),
    "meshes",
    across=("alphas",),
)
