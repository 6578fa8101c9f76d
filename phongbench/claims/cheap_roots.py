"""Claim e: no accurate reciprocal square root is needed."""

from __future__ import annotations

import pandas as pd

from phongbench.claims.claim import CONDITIONS, FAILS, HOLDS, VISIBLE, Claim, Finding, LackingRowsError, Numbers
from phongbench.claims.cuts import KEY, Rows, at, coverage, evidence, forms_of, near_gamma
from phongbench.claims.words import codes, exponents, sentence
from phongbench.sources import WIKIPEDIA_PHONG

#: perturbation -> which cheap root normalised the vectors, the most accurate first
ROOTS = {
    "rsqrt-12": "a 12-bit root",
    "rsqrt-bits-2": "the bit trick with two Newton steps",
    "rsqrt-bits-1": "the bit trick with one Newton step",
    "half": "rounding to float16",
    "series": "Lyon's short series",
    "rsqrt-bits-0": "the bit trick alone",
}
#: the gamma that is judged, or the measured one nearest to it
GAMMA = 8
FORMS = ("dot", "difference", "cross")


def judge(rows: Rows) -> Finding:
    """What the lengths that a cheap reciprocal square root leaves change in Lyon's formula, slope alpha / gamma,
    gamma 8, for each root and lambda form. Enough at an exponent: a change of at most 1/255. Judged by the better of
    the difference and cross forms, those that the claim is about. Holds if every root is enough at every measured
    exponent, fails if none is at any, else holds under conditions.
    """
    cells = _source(rows)
    measured = sorted(float(alpha) for alpha in cells["alpha"].unique())
    told = [
        _record(mine, measured)
        for root in ROOTS
        for form in forms_of(cells)
        if len(mine := at(cells, perturbation=root, lambda_form=form))
    ]
    meant = [one for one in told if one["lambda_form"] != "dot"] or told
    best = {root: max((one for one in meant if one["root"] == root), key=lambda one: len(one["alphas"]))
            for root in dict.fromkeys(one["root"] for one in meant)}  # fmt: skip
    whole = all(one["alphas"] == measured for one in best.values())
    verdict = HOLDS if whole else CONDITIONS if any(one["alphas"] for one in best.values()) else FAILS
    return Finding(verdict, _because(best, told, measured), tuple(told), _rows(cells, told), coverage(cells))


def _source(rows: Rows) -> pd.DataFrame:
    cells = at(
        rows.lengths, approximation="lyon", space="reflect", beta_policy="taylor", lambda_form=FORMS,
        perturbation=tuple(ROOTS),
    )  # fmt: skip
    if cells.empty:
        raise LackingRowsError(
            "the run has no rows on vectors normalised by a cheap root",
            None,
            'measure them: phongbench run with lyon and "lengths" among its strata',
        )
    return near_gamma(cells, GAMMA)


def _record(mine: pd.DataFrame, measured: list[float]) -> Numbers:
    change = mine.groupby("alpha")["length_max"].max()
    good = [float(alpha) for alpha in change.index[change <= VISIBLE]]
    worst = mine.sort_values(["length_max", *KEY], kind="stable").iloc[-1]
    return {
        "root": str(mine["perturbation"].iloc[0]), "lambda_form": str(mine["lambda_form"].iloc[0]),
        "gamma": int(mine["gamma"].iloc[0]), "max_change": VISIBLE, "alphas": good,
        "alpha_from": good[0] if good else None, "alpha_to": good[-1] if good else None,
        "alphas_measured": len(measured), "worst_change": float(worst["length_max"]),
        "worst_codes": 255 * float(worst["length_max"]), "worst_alpha": float(worst["alpha"]),
    }  # fmt: skip


def _because(best: dict[str, Numbers], told: list[Numbers], measured: list[float]) -> str:
    parts = [
        f"{ROOTS[root]} is enough for {one['lambda_form']} at {exponents(one['alphas'], measured)}"
        for root, one in best.items()
    ]
    for one in told:
        if one["lambda_form"] == "dot" and one["root"] == next(iter(best)):
            where, most = exponents(one["alphas"], measured), codes(one["worst_change"])
            parts += [f"for dot, {ROOTS[one['root']]} is at {where}, and changes it by up to {most}"]
    return sentence(*parts)


def _rows(cells: pd.DataFrame, told: list[Numbers]) -> tuple[Numbers, ...]:
    """The worst row of each root and form."""
    top = cells.sort_values(["length_max", *KEY], kind="stable").drop_duplicates(
        ["perturbation", "lambda_form"], keep="last"
    )
    order = {(one["root"], one["lambda_form"]): place for place, one in enumerate(told)}
    places = [order[row["perturbation"], row["lambda_form"]] for _, row in top.iterrows()]
    return evidence("accuracy", "length_max", top.assign(place=places).sort_values("place"))


CLAIM = Claim(
    "e",
    "No accurate reciprocal square root is needed to normalise the vectors",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy",),
    "stability",
)
