"""Claim b: the approximation holds for a sufficiently large gamma."""

from __future__ import annotations

import pandas as pd

from phongbench.claims.claim import CONDITIONS, FAILS, HOLDS, VISIBLE, Claim, Finding, LackingRowsError, Numbers
from phongbench.claims.cuts import Rows, at, coverage, evidence, forms_of
from phongbench.claims.words import codes, exponents, sentence
from phongbench.sources import WIKIPEDIA_PHONG


def judge(rows: Rows) -> Finding:
    """Lyon's formula with slope alpha / gamma on the highlight of unit vectors. Its limit for gamma without end is
    exp(-alpha lambda), the gaussian row of the same exponent: where that errs by at most 1/255, every sufficiently
    large gamma does. Elsewhere some measured gammas may be within 1/255 in passing, near gamma = alpha, and larger ones
    are not. Holds if the limit is within 1/255 at every measured exponent in the dot form, fails if at none, else holds
    under conditions.
    """
    plain = at(rows.unit, space="reflect", beta_policy="taylor")
    lyon, limit = at(plain, approximation="lyon"), at(plain, approximation="gaussian")
    forms = [form for form in forms_of(lyon, ("dot", "difference", "cross")) if form in forms_of(limit)]
    if not forms:
        raise LackingRowsError(
            "the run lacks unit rows of lyon, or of its limit gaussian, with Taylor slopes",
            None,
            "measure them: phongbench run, or with --only lyon,gaussian",
        )
    told = [_record(at(lyon, lambda_form=f), at(limit, lambda_form=f)) for f in forms if f != "difference"]
    told = told or [_record(lyon, limit)]
    good, measured = told[0]["alphas"], told[0]["alphas_measured"]
    verdict = FAILS if not good else HOLDS if len(good) == len(measured) else CONDITIONS
    return Finding(verdict, _because(told[0]), tuple(told), _rows(lyon, limit, told), coverage(limit))


def _record(lyon: pd.DataFrame, limit: pd.DataFrame) -> Numbers:
    """Where the limit is within 1/255; from which measured gamma on; where only in passing; where never."""
    measured = sorted(limit["alpha"].unique().tolist())
    good = sorted(limit.loc[limit["max_abs"] <= VISIBLE, "alpha"].tolist())
    passing, never, reached = [], [], []
    for alpha in measured:
        mine = at(lyon, alpha=alpha).sort_values("gamma")
        gammas = mine["gamma"].astype(int).tolist()
        within = [g for g, error in zip(gammas, mine["max_abs"], strict=True) if error <= VISIBLE]
        beyond = [g for g in gammas if g not in within]
        if alpha in good:
            start = next((g for g in gammas if all(h in within for h in gammas if h >= g)), None)
            reached.append({"alpha": alpha, "gamma_from": start, "gamma_measured_to": max(gammas, default=None)})
        elif within and len(within) + len(beyond):
            passing.append({"alpha": alpha, "gammas": within})
        else:
            never.append(alpha)
    worst = limit.sort_values(["max_abs", "alpha"], kind="stable").iloc[-1]
    return {
        "lambda_form": str(limit["lambda_form"].iloc[0]), "max_error": VISIBLE, "alphas": good,
        "alpha_from": good[0] if good else None, "alphas_measured": measured, "gamma_by_alpha": reached,
        "only_in_passing": passing, "never": never, "worst_limit_error": float(worst["max_abs"]),
        "worst_limit_alpha": float(worst["alpha"]),
    }  # fmt: skip


def _because(record: Numbers) -> str:
    measured = record["alphas_measured"]
    where = exponents(record["alphas"], measured)
    parts = [f"in the {record['lambda_form']} form the limit of ever larger gamma is within 1/255 at {where}"]
    if record["only_in_passing"]:
        passing = [one["alpha"] for one in record["only_in_passing"]]
        parts.append(f"at {exponents(passing, measured)} only gammas near alpha are")
    if record["never"]:
        parts.append(f"at {exponents(record['never'], measured)} no measured gamma is")
    worst = f"the limit's largest error is {codes(record['worst_limit_error'])}"
    return sentence(*parts, f"{worst}, at alpha {record['worst_limit_alpha']:g}")


def _rows(lyon: pd.DataFrame, limit: pd.DataFrame, told: list[Numbers]) -> tuple[Numbers, ...]:
    """The limit at its worst exponent and at the first within; lyon's best where the limit is not."""
    first = told[0]
    mine = at(limit, lambda_form=first["lambda_form"], alpha=(first["worst_limit_alpha"], first["alpha_from"]))
    outside = [*first["never"], *(one["alpha"] for one in first["only_in_passing"])]
    best = at(lyon, lambda_form=first["lambda_form"], alpha=outside)
    best = best.sort_values(["alpha", "max_abs", "gamma"], kind="stable").drop_duplicates("alpha")
    return evidence("accuracy", "max_abs", pd.concat([mine, best]))


CLAIM = Claim(
    "b",
    "The approximation holds for a sufficiently large gamma",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy",),
    "error_gamma",
)
