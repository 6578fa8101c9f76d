"""How sure the numbers are: the same largest error, measured in up to four ways, and whether they agree."""

from typing import Any

import pandas as pd

from phongbench.accuracy.probes.consistency import UNIT_STRATA, VECTORS
from phongbench.analysis.rows import Rows, at
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import alpha_is, label, missing, number, records, share

#: What tells laws apart; with the precision, cells.
LAW = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"]
#: The gamma and the slopes that stand for a formula on the page; all are in the CSV.
SHOWN_GAMMA, SHOWN_SLOPES = 8, ("none", "taylor")
MEASURED = ("sampled", "searched", "exhaustive")


def sureness(study: Rows) -> Table | Absent:
    """Sampled, searched, exhaustive and certified maxima side by side, and the re-check of the truth."""
    data = maxima(study)
    if data.empty or not data[["searched", "exhaustive", "certified"]].notna().any().any():
        return Absent(
            "Every largest error of this run is that of samples: a lower bound.",
            "Run with --probe cosines,search,certify,recheck.",
        )
    shown = _headline(study, data)
    body = tuple(
        (
            label(row),
            *(number(row[name], 5) for name in MEASURED),
            number(row["model"], 5),
            number(row["certified"], 5),
            _gap(row["certified"], row["model"]),
        )
        for row in records(shown)
    )
    headings = ("formula", "sampled", "searched", "every cosine", "formula alone, measured", "its proven bound", "gap")
    basis = (
        f"{study.precision}, {alpha_is(study.alpha)}; sampled: unit vectors; searched: all nearly unit vectors; "
        "every cosine: λ made of each float x itself, so the rounding of a·b is left out; the formula alone: in exact "
        "arithmetic, for which its bound is proven"
    )
    return Table(headings, body, data, _sentence(study, data), basis, frozenset(range(1, 7)))


def maxima(study: Rows) -> pd.DataFrame:
    """One row per cell: its largest errors by coverage, that of the formula alone, and the certified bound of that."""
    rows = study.accuracy
    rows = rows[rows["gated"].astype(bool) & (rows["truth"] == "angle") & (rows["perturbation"] == "none")]
    rows = rows[(rows["stratum"] != "hostile")]
    cell = [*LAW, "precision"]
    table = largest(rows[rows["stratum"].isin(UNIT_STRATA)], cell, "max_abs", "sampled")
    for name, chosen in (
        ("searched", rows[rows["stratum"] == VECTORS]),
        ("exhaustive", rows[rows["coverage"] == "exhaustive"]),
    ):
        table = table.merge(largest(chosen, cell, "max_abs", name), on=cell, how="outer")
    measured = rows[rows["coverage"] != "certified"]
    table = table.merge(largest(measured, LAW, "model_max", "model"), on=LAW, how="left")
    certified = rows[rows["coverage"] == "certified"]
    table = table.merge(largest(certified, LAW, "model_max", "certified"), on=LAW, how="left")
    return table.sort_values(cell, kind="stable").reset_index(drop=True)


def largest(rows: pd.DataFrame, key: list[str], metric: str, name: str) -> pd.DataFrame:
    """The largest of a metric for each key, under this name."""
    return rows.groupby(key, dropna=False, observed=True)[metric].max().rename(name).reset_index()


def _headline(study: Rows, data: pd.DataFrame) -> pd.DataFrame:
    """Each formula and form once, at one exponent: Taylor's slope, and gamma 8 if there is one."""
    return headline(at(data, precision=study.precision, alpha=study.alpha, space="reflect"))


def headline(data: pd.DataFrame) -> pd.DataFrame:
    """Of rows at one exponent each formula and form once."""
    mine = at(data, beta_policy=SHOWN_SLOPES)
    order = mine.assign(away=(mine["gamma"].astype(float) - SHOWN_GAMMA).abs())
    order = order.sort_values(["approximation", "lambda_form", "away"], kind="stable")
    return order.drop_duplicates(["approximation", "lambda_form"]).drop(columns="away")


def _gap(bound: Any, measured: Any) -> str:
    if missing(bound) or missing(measured) or not measured > 1e-9:
        return "–"
    return f"{100 * (bound / measured - 1):.2f}\u00a0%"


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    violations = study.run.manifest.get("violations") or []
    agreement = (
        f"{len(violations)} contradiction{'s' * (len(violations) > 1)} between rows: a bug, see the top of the page"
        if violations
        else "No two numbers contradict each other: sampled ≤ searched, sampled ≤ every cosine, none above its bound"
    )
    laws = data[data["certified"].notna() & (data["model"] > 1e-7)].drop_duplicates(LAW)
    if len(laws):
        gap = (laws["certified"] / laws["model"] - 1).max()
        agreement += f"; the bounds of {number(len(laws))} laws lie within {share(gap, 2)} of what was measured"
    return f"{agreement}. {_recheck(study)}".strip()


def _recheck(study: Rows) -> str:
    facts = (study.run.manifest.get("probes") or {}).get("recheck")
    if not facts:
        return ""
    values = facts["random_values"] + facts["worst_values"]
    off = max(facts["random_disagreement"], facts["worst_disagreement"])
    part = max(facts["random_share"], facts["worst_share"])
    return (
        f"{number(values)} exact values were computed again with {facts['digits']} digits: the truth is off by at most "
        f"{number(off, 2)}, {share(part, 2)} of its stated error."
    )
