"""Claim a: a gamma of 4 or 8 is enough."""

import pandas as pd

from phongbench.analysis.claims.claim import FINE, VISIBLE, Claim, Finding, LackingRowsError, Record, grade, reach
from phongbench.analysis.claims.evidence import coverage, evidence
from phongbench.analysis.claims.words import codes, exponents, sentence
from phongbench.analysis.rows import Rows, at, forms_of
from phongbench.formulas.citations import WIKIPEDIA_PHONG

GAMMAS = (4, 8)
#: the slope that the textbooks give
TEXTBOOK = "taylor"


def judge(rows: Rows) -> Finding:
    """Lyon's formula with gamma 4 and gamma 8 on the highlight of unit vectors, each lambda form and slope; the
    difference form goes with dot, whose number it is there. Enough at an exponent: it measures at most 1/255.
    Holds if gamma 8 with the textbook's slope alpha / gamma is enough at every measured exponent in the dot form; holds
    under conditions if either gamma with any slope and form is enough at some exponent; else fails.
    """
    cells = at(rows.largest_errors, approximation="lyon", space="reflect", gamma=GAMMAS)
    if cells.empty:
        raise LackingRowsError(
            "the run has no unit rows of lyon with gamma 4 or 8",
            "measure them: phongbench run, or with --only lyon --gamma 4,8",
        )
    records = [
        _record(mine, rows.alphas)
        for (gamma, slope) in sorted(set(zip(cells["gamma"], cells["beta_policy"], strict=True)), reverse=True)
        for form in forms_of(cells, ("dot", "cross")) or forms_of(cells)
        if len(mine := at(cells, gamma=gamma, beta_policy=slope, lambda_form=form))
    ]
    best = [record for record in records if record["gamma"] == max(GAMMAS)] or records
    usual = [r for r in best if r["beta_policy"] == TEXTBOOK and r["lambda_form"] == "dot"]
    whole = any(record["alphas"] == rows.alphas for record in usual)
    some = any(record["alphas"] for record in records)
    good = {alpha for record in records for alpha in record["alphas"]}
    verdict = grade(whole, some, len(good) / len(rows.alphas))
    return Finding(verdict, _because(records, rows.alphas), tuple(records), _rows(cells, records), coverage(cells))


def _record(mine: pd.DataFrame, measured: list[float]) -> Record:
    good, fine = (sorted(mine.loc[mine["max_abs"] <= limit, "alpha"].tolist()) for limit in (VISIBLE, FINE))
    worst = mine.sort_values(["max_abs", "alpha"], kind="stable").iloc[-1]
    first = mine.iloc[0]
    return {
        "gamma": int(first["gamma"]),
        "beta_policy": first["beta_policy"],
        "lambda_form": first["lambda_form"],
        "max_error": VISIBLE,
        **reach(good, measured),
        "alphas_10bit": fine,
        "worst_error": float(worst["max_abs"]),
        "worst_codes": 255 * float(worst["max_abs"]),
        "worst_alpha": float(worst["alpha"]),
    }


def _because(records: list[Record], measured: list[float]) -> str:
    gamma, form = max(r["gamma"] for r in records), records[0]["lambda_form"]
    parts = [
        f"with slope {r['beta_policy']} at {exponents(r['alphas'], measured)} "
        f"(worst {codes(r['worst_error'])}, alpha {r['worst_alpha']:g})"
        for r in sorted(records, key=lambda r: r["beta_policy"] != TEXTBOOK)
        if (r["gamma"], r["lambda_form"]) == (gamma, form)
    ]
    fewer = [r for r in records if r["gamma"] < gamma and r["lambda_form"] == form]
    if fewer:
        best = min(fewer, key=lambda r: (-len(r["alphas"]), r["worst_error"]))
        where, most = exponents(best["alphas"], measured), codes(best["worst_error"])
        parts.append(f"gamma {best['gamma']} at best, with slope {best['beta_policy']}, at {where} (worst {most})")
    return sentence(f"gamma {gamma} in the {form} form measures at most 1/255 {'; '.join(parts)}")


def _rows(cells: pd.DataFrame, records: list[Record]) -> tuple[Record, ...]:
    """The worst row of each slope of the largest gamma, and its largest exponent that is enough."""
    wanted = [
        (r, alpha)
        for r in records
        if r["gamma"] == max(x["gamma"] for x in records)
        for alpha in dict.fromkeys((r["worst_alpha"], r["alpha_to"]))
        if alpha is not None
    ]
    picked = [at(cells, **{k: r[k] for k in ("gamma", "beta_policy", "lambda_form")}, alpha=a) for r, a in wanted]
    return evidence("accuracy", "max_abs", pd.concat(picked))


CLAIM = Claim(
    "a",
    "A gamma of 4 or 8 is typically enough",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy",),
    "error_gamma",
    across=("alphas",),
)
