"""Claim b: the approximation holds for a sufficiently large gamma."""

import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import coverage, evidence
from phongbench.analysis.claims.words import codes, exponents, sentence
from phongbench.analysis.rows import Rows, at, forms_of
from phongbench.formulas.citations import WIKIPEDIA_PHONG

#: what gammas measure at most 1/255 at an exponent: all beyond some, some but no larger ones, or none
ALWAYS, PASSING, NEVER = "from some gamma on", "in passing", "never"


def judge(rows: Rows) -> Finding:
    """Lyon's formula with slope alpha / gamma on the highlight of unit vectors. Its limit for gamma without end is
    exp(-alpha lambda), the gaussian row of the same exponent: where that errs by at most 1/255, every sufficiently
    large gamma does. Elsewhere some gammas may measure at most 1/255 in passing, near gamma = alpha, and larger ones
    more. Holds if the limit measures at most 1/255 at every exponent in the dot form, fails if at none, else holds
    under conditions.
    """
    plain = at(rows.largest_errors, space="reflect", beta_policy="taylor")
    lyon, limit = at(plain, approximation="lyon"), at(plain, approximation="gaussian")
    forms = [form for form in forms_of(lyon, ("dot", "difference", "cross")) if form in forms_of(limit)]
    if not forms:
        raise LackingRowsError(
            "the run lacks unit rows of lyon, or of its limit gaussian, with Taylor slopes",
            "measure them: phongbench run, or with --only lyon,gaussian",
        )
    shown = [form for form in forms if form != "difference"] or forms
    records = [
        _record(at(lyon, lambda_form=form, alpha=alpha), mine)
        for form in shown
        for alpha in sorted(limit["alpha"].unique())
        if len(mine := at(limit, lambda_form=form, alpha=alpha))
    ]
    first = [one for one in records if one["lambda_form"] == shown[0]]
    always = [one["within"] == ALWAYS for one in first]
    verdict = grade(all(always), any(always), sum(always) / len(always))
    return Finding(verdict, _because(first), tuple(records), _rows(lyon, limit, first), coverage(limit))


def _record(lyon: pd.DataFrame, limit: pd.DataFrame) -> Record:
    """What ever larger gammas come to at one exponent, and which measure at most 1/255."""
    mine = lyon.sort_values("gamma", kind="stable")
    gammas = mine["gamma"].astype(int).tolist()
    good = mine.loc[mine["max_abs"] <= VISIBLE, "gamma"].astype(int).tolist()
    error = float(limit["max_abs"].iloc[0])
    always = error <= VISIBLE
    stays = [g for g in good if all(h in good for h in gammas if h >= g)] if always else []
    return {
        "lambda_form": str(limit["lambda_form"].iloc[0]),
        "alpha": float(limit["alpha"].iloc[0]),
        "max_error": VISIBLE,
        "limit_error": error,
        "within": ALWAYS if always else PASSING if good else NEVER,
        "gamma_from": min(stays, default=None),
        "gammas_within": good,
        "gamma_measured_to": max(gammas, default=None),
    }


def _because(records: list[Record]) -> str:
    measured = [one["alpha"] for one in records]
    good, passing, never = ([one["alpha"] for one in records if one["within"] == w] for w in (ALWAYS, PASSING, NEVER))
    worst = max(records, key=lambda one: (one["limit_error"], -one["alpha"]))
    limit = f"in the {worst['lambda_form']} form the limit of ever larger gamma"
    parts = [f"{limit} measures at most 1/255 at {exponents(good, measured)}"]
    parts += [f"at {exponents(passing, measured)} only gammas near alpha are"] if passing else []
    parts += [f"at {exponents(never, measured)} no measured gamma is"] if never else []
    parts.append(f"the limit's largest error is {codes(worst['limit_error'])}, at alpha {worst['alpha']:g}")
    return sentence(*parts)


def _rows(lyon: pd.DataFrame, limit: pd.DataFrame, records: list[Record]) -> tuple[Record, ...]:
    """The limit at its worst exponent and at the first within; lyon's best gamma where the limit is not."""
    form = records[0]["lambda_form"]
    worst = max(records, key=lambda one: (one["limit_error"], -one["alpha"]))["alpha"]
    first = [one["alpha"] for one in records if one["within"] == ALWAYS][:1]
    best = at(lyon, lambda_form=form, alpha=[one["alpha"] for one in records if one["within"] != ALWAYS])
    best = best.sort_values(["alpha", "max_abs", "gamma"], kind="stable").drop_duplicates("alpha")
    return evidence("accuracy", "max_abs", pd.concat([at(limit, lambda_form=form, alpha=[worst, *first]), best]))


CLAIM = Claim(
    "b",
    "The approximation holds for a sufficiently large gamma",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy",),
    "error_gamma",
    across=("alphas", "gammas"),
)
