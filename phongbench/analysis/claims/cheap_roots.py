"""Claim e: no accurate reciprocal square root is needed."""

from dataclasses import replace

import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade, reach
from phongbench.analysis.claims.evidence import coverage, evidence
from phongbench.analysis.claims.price import priced
from phongbench.analysis.claims.words import codes, exponents, listed, sentence
from phongbench.analysis.rows import Rows, at, forms_of, near_gamma
from phongbench.formulas.citations import WIKIPEDIA_PHONG
from phongbench.inputs.length_errors import CAUSES
from phongbench.results.schema import CASE

#: perturbation -> which cheap root, or rounding, made the vectors; the first clause of its text
ROOTS = {cause.name: cause.text.partition(",")[0] for cause in CAUSES if cause.both}
#: the gamma that is judged, or the measured one nearest to it
GAMMA = 8
FORMS = ("dot", "difference", "cross")
#: the same formulas with the cheap root and with accurate ones, two of them or one for the pair
SAVED = (("lyon:cross:8/fast", "lyon:cross:8/each"), ("phong/fast", "phong/each"), ("phong/fast", "phong/once"))


def judge(rows: Rows) -> Finding:
    """What the lengths that a cheap reciprocal square root leaves change in Lyon's formula, slope alpha / gamma,
    gamma 8, for each root and lambda form. Enough at an exponent: a change of at most 1/255. Judged by the better of
    the difference and cross forms, those that the claim is about. Holds if every root is enough at every measured
    exponent and, where timed, the bit trick with a Newton step is surely faster than accurate roots, two or one for the
    pair; fails if no root is enough at any exponent; else holds under conditions.
    """
    cells = _source(rows)
    measured = sorted(float(alpha) for alpha in cells["alpha"].unique())
    records = [
        _record(mine, measured)
        for root in _by_accuracy(cells)
        for form in forms_of(cells)
        if len(mine := at(cells, perturbation=root, lambda_form=form))
    ]
    judged = [one for one in records if one["lambda_form"] != "dot"] or records
    best = {
        root: max((o for o in judged if o["root"] == root), key=lambda o: (len(o["alphas"]), -o["worst_change"]))
        for root in dict.fromkeys(one["root"] for one in judged)
    }
    whole = all(one["alphas"] == measured for one in best.values())
    met = sum(len(one["alphas"]) for one in best.values())
    share, because = met / (len(best) * len(measured)), _because(best, records, measured)
    decisive = _rows(cells, list(best.values()))
    found = Finding(grade(whole, met, share), because, tuple(records), decisive, coverage(cells))
    return priced(replace(found, brief=_brief(best, measured)), rows, SAVED)


def _brief(best: dict[str, Record], measured: list[float]) -> str:
    """How many of the roots are enough everywhere, and what the worst changes."""
    everywhere = sum(one["alphas"] == measured for one in best.values())
    root, worst = max(best.items(), key=lambda entry: entry[1]["worst_change"])
    change = f"{ROOTS[root]} changes up to {codes(worst['worst_change'])}, in the {worst['lambda_form']} form"
    return sentence(f"{everywhere} of {len(best)} cheap roots are enough at every exponent", change)


def _source(rows: Rows) -> pd.DataFrame:
    cells = at(
        rows.largest_changes,
        approximation="lyon",
        space="reflect",
        beta_policy="taylor",
        lambda_form=FORMS,
        perturbation=tuple(ROOTS),
    )
    if cells.empty:
        raise LackingRowsError(
            "the run has no rows on vectors normalised by a cheap root",
            'measure them: phongbench run with lyon among --only; a plan\'s strata must hold "lengths"',
        )
    return near_gamma(cells, GAMMA)


def _by_accuracy(cells: pd.DataFrame) -> list[str]:
    """The roots, the one whose lengths err least first."""
    size = cells["length_error"].abs().groupby(cells["perturbation"]).max()
    return sorted(map(str, size.index), key=lambda root: (float(size[root]), root))


def _record(mine: pd.DataFrame, measured: list[float]) -> Record:
    change = mine.groupby("alpha")["length_max"].max()
    good = [float(alpha) for alpha in change.index[change <= VISIBLE]]
    worst = mine.sort_values(["length_max", *CASE], kind="stable").iloc[-1]
    return {
        "root": str(mine["perturbation"].iloc[0]),
        "lambda_form": str(mine["lambda_form"].iloc[0]),
        "length_error": float(mine["length_error"].iloc[0]),
        "gamma": int(mine["gamma"].iloc[0]),
        "max_change": VISIBLE,
        **reach(good, measured),
        "worst_change": float(worst["length_max"]),
        "worst_codes": 255 * float(worst["length_max"]),
        "worst_alpha": float(worst["alpha"]),
    }


def _because(best: dict[str, Record], records: list[Record], measured: list[float]) -> str:
    """Roots that are enough at the same exponents for the same form share a part of the sentence."""
    alike: dict[tuple[str, tuple[float, ...]], list[str]] = {}
    for root, one in best.items():
        alike.setdefault((one["lambda_form"], tuple(one["alphas"])), []).append(root)
    parts = []
    for (form, alphas), roots in alike.items():
        are, most = "are" if len(roots) > 1 else "is", max(best[root]["worst_change"] for root in roots)
        where = f"at {exponents(alphas, measured)} (a change of up to {codes(most)})"
        parts.append(f"for {form} {listed(ROOTS[root] for root in roots)} {are} enough {where}")
    first = next(iter(best))
    dot = [one["alphas"] for one in records if (one["lambda_form"], one["root"]) == ("dot", first)]
    return sentence(*parts, *(f"for dot {ROOTS[first]} is at {exponents(alphas, measured)}" for alphas in dot))


def _rows(cells: pd.DataFrame, shown: list[Record]) -> tuple[Record, ...]:
    """The worst row of each of these roots and forms."""
    top = cells.sort_values(["length_max", *CASE], kind="stable")
    worst = [at(top, perturbation=one["root"], lambda_form=one["lambda_form"]).tail(1) for one in shown]
    return evidence("accuracy", "length_max", pd.concat(worst))


CLAIM = Claim(
    "e",
    "No accurate reciprocal square root is needed to normalise the vectors",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy", "timing"),
    "stability",
    across=("alphas",),
)
