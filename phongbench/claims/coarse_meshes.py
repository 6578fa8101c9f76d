"""Claim d: R and V practically need no normalisation, except on very coarse meshes."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from phongbench.claims.claim import CONDITIONS, FAILS, HOLDS, VISIBLE, Claim, Finding, LackingRowsError, Numbers
from phongbench.claims.cuts import FORMS, Rows, at, evidence, near_gamma
from phongbench.claims.words import exponents, sentence
from phongbench.sources import WIKIPEDIA_PHONG

#: edges of 10 degrees: a sphere of 36 segments around. What is coarser is called very coarse
COARSE = 10.0
#: the gamma that is judged, or the measured one nearest to it
GAMMA = 8
#: the form, and the way to R, that the textbooks mean
MEANT = {"lambda_form": "cross", "pair": "classic"}
PAIRS = ("classic", "lengthwise", "half")
_SAME = ["mesh", "edge_degrees", "pair", "lambda_form", "alpha"]


def judge(rows: Rows) -> Finding:
    """Lyon's formula, slope alpha / gamma, gamma 8, with normals interpolated over triangles and left as they are,
    against exact Phong of the interpolated normals made unit. Not normalising is good enough at an edge angle if, on
    every mesh and up to that angle, it adds at most 1/255 to the largest error that the same cell has with renormalised
    normals. Judged in the cross form, R as 2 (L.N) N - L. Holds if good enough up to edges of 10 degrees at every
    measured exponent, which spares very coarse meshes only; holds under conditions if so at some exponent, or at every
    one up to some smaller angle, or in another form or with another way to R; else fails.
    """
    cells = _compared(rows)
    alphas = sorted(cells["alpha"].unique())
    told = [
        _record(mine)
        for pair in PAIRS
        for form in FORMS
        for alpha in alphas
        if len(mine := at(cells, pair=pair, lambda_form=form, alpha=alpha))
    ]
    meant = [one for one in told if all(one[k] == v for k, v in MEANT.items())]
    fine = [one["alpha"] for one in meant if (one["edge_degrees_to"] or 0.0) >= COARSE]
    some = [one for one in told if one["edge_degrees_to"] is not None]
    verdict = HOLDS if meant and len(fine) == len(meant) else CONDITIONS if some else FAILS
    return Finding(verdict, _because(meant or told, told, fine, alphas), tuple(told), _rows(rows, cells), "sampled")


def _source(rows: Rows) -> pd.DataFrame:
    cells = rows.meshed
    if len(cells):
        cells = at(cells, approximation="lyon", beta_policy="taylor", truth="interpolated", pair=PAIRS)
    return near_gamma(cells, GAMMA)


def _compared(rows: Rows) -> pd.DataFrame:
    """Rows of raw normals with `added`: by how much their largest error exceeds that of renormalised ones."""
    cells = _source(rows)
    raw, unit = at(cells, normals="raw"), at(cells, normals="renormalised")
    wide = raw.merge(unit[[*_SAME, "max_abs"]], on=_SAME, suffixes=("", "_renormalised"))
    if wide.empty:
        raise LackingRowsError(
            "the run has no rows on interpolated normals of meshes",
            None,
            "measure them: phongbench run with --probe mesh, or a preset whose probes hold it",
        )
    return wide.assign(added=wide["max_abs"] - wide["max_abs_renormalised"])


def reach(angles: Sequence[float], added: Sequence[float], limit: float) -> float | None:
    """The largest angle up to which nothing is added beyond the limit, on whatever mesh; None if at none."""
    bad = [angle for angle, more in zip(angles, added, strict=True) if not more <= limit]
    first = min(bad, default=float("inf"))
    good = [angle for angle in angles if angle < first]
    return max(good, default=None)


def _record(mine: pd.DataFrame) -> Numbers:
    angles, added = [float(a) for a in mine["edge_degrees"]], [float(a) for a in mine["added"]]
    first = mine.iloc[0]
    return {
        "pair": str(first["pair"]), "lambda_form": str(first["lambda_form"]), "alpha": float(first["alpha"]),
        "gamma": int(first["gamma"]), "max_added": VISIBLE, "edge_degrees_to": reach(angles, added, VISIBLE),
        "edge_degrees_to_two_codes": reach(angles, added, 2 * VISIBLE), "edge_degrees_measured": sorted(set(angles)),
        "largest_added": max(added),
    }  # fmt: skip


def _because(meant: list[Numbers], told: list[Numbers], fine: list[float], alphas: list[float]) -> str:
    first = meant[0]
    way = f"in the {first['lambda_form']} form with {first['pair']} R, gamma {first['gamma']}"
    where = exponents(fine, [one["alpha"] for one in meant])
    ends = [meant[0], meant[-1]] if len(meant) > 1 else meant
    parts = [f"{way}, raw normals add at most one code up to edges of {COARSE:g} degrees at {where}"]
    parts.append(f"they do up to {' and '.join(_far(one) for one in ends)}")
    last = alphas[-1]
    others = [one for one in told if one["alpha"] == last and one not in meant]
    best = max(others, key=lambda one: one["edge_degrees_to"] or 0.0, default=None)
    if best is not None:
        parts.append(f"the best other way is {best['lambda_form']} with {best['pair']}: up to {_far(best)}")
    return sentence(*parts)


def _far(one: Numbers) -> str:
    angle = one["edge_degrees_to"]
    return f"{'no measured edge' if angle is None else f'{angle:.3g} degrees'} at alpha {one['alpha']:g}"


def _rows(rows: Rows, cells: pd.DataFrame) -> tuple[Numbers, ...]:
    """For the smallest and the largest exponent: the finest edges that add more than a code, raw and renormalised."""
    meant = at(cells, **MEANT)
    meant = meant if len(meant) else cells
    bad = meant[meant["added"] > VISIBLE].sort_values(["edge_degrees", "added"], ascending=[True, False], kind="stable")
    kept = bad.drop_duplicates("alpha")
    kept = kept[kept["alpha"].isin([kept["alpha"].min(), kept["alpha"].max()])].sort_values("alpha", kind="stable")
    source = _source(rows)
    found = [evidence("meshes", "max_abs", at(source, **{c: row[c] for c in _SAME})) for _, row in kept.iterrows()]
    return tuple(row for part in found for row in part)


CLAIM = Claim(
    "d",
    "R and V practically need not be normalised, except on very coarse meshes",
    WIKIPEDIA_PHONG,
    judge,
    ("meshes",),
    "meshes",
)
