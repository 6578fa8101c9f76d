"""Claim c: the cross form is much less sensitive to normalisation."""

import pandas as pd

from phongbench.analysis.claims.claim import VISIBLE, Claim, Finding, LackingRowsError, Record, grade
from phongbench.analysis.claims.evidence import coverage, evidence
from phongbench.analysis.claims.price import priced
from phongbench.analysis.claims.words import exponents, sentence, times
from phongbench.analysis.normalising_cost import FROM_PAIR
from phongbench.analysis.rows import Rows, at, near_gamma
from phongbench.formulas import error_laws
from phongbench.formulas.citations import WIKIPEDIA_PHONG
from phongbench.results.schema import CASE

#: much less: at most a quarter of the change
MUCH = 4.0
#: the gamma that is judged, or the measured one nearest to it
GAMMA = 8
#: ways in which lengths of two vectors are wrong
WAYS = ("a", "both", "opposite")
FORMS = ("dot", "difference", "cross")
_CELL = [column for column in CASE if column != "lambda_form"]


def judge(rows: Rows) -> Finding:
    """What wrong lengths alone change in Lyon's formula, slope alpha / gamma, gamma 8: one vector, both alike, and both
    opposite. Against dot: the cross form is much less sensitive at an exponent if, wherever dot changes by more than
    1/255, cross changes by at most a quarter of that. Against difference: for one wrong vector, up to which length
    error, times alpha, difference changes no more than cross, and from which on cross does.
    Holds if cross is much less sensitive than dot at every measured exponent and nowhere more sensitive than
    difference, and, where timed, surely faster on vectors as they are than exact Phong with one root, to which lengths
    do not matter either; fails if it is less sensitive at no exponent; else holds under conditions.
    """
    cells = _compared(rows)
    records = [_against_dot(cells)]
    if "difference" in cells:
        records += [_against_difference(mine) for way in WAYS if len(mine := at(cells, perturbation=way))]
    good, measured = records[0]["alphas"], records[0]["alphas_measured"]
    safest = all(record["cross_never_worse"] for record in records[1:])
    verdict = grade(good == measured and safest, good, len(good) / len(measured))
    found = Finding(verdict, _because(records), tuple(records), _rows(rows, cells, records), coverage(_source(rows)))
    return priced(found, rows, [FROM_PAIR])


def _source(rows: Rows) -> pd.DataFrame:
    cells = at(
        rows.largest_changes,
        approximation="lyon",
        space="reflect",
        beta_policy="taylor",
        lambda_form=FORMS,
        perturbation=WAYS,
    )
    return near_gamma(cells, GAMMA)


def _compared(rows: Rows) -> pd.DataFrame:
    """One row per exponent and wrong length, with a column of what changes for each form."""
    cells = _source(rows)
    wide = cells.pivot(index=_CELL, columns="lambda_form", values="length_max").reset_index()
    wide = wide.dropna(subset=[form for form in FORMS if form in wide])
    if wide.empty or "dot" not in wide or "cross" not in wide:
        raise LackingRowsError(
            "the run has no rows of lyon's dot and cross forms on vectors of wrong length",
            'measure them: phongbench run, with "lengths" among the strata and dot,cross among --lambda',
        )
    return wide.sort_values(_CELL, kind="stable").reset_index(drop=True)


def _against_dot(cells: pd.DataFrame) -> Record:
    seen = cells[cells["dot"] > VISIBLE].assign(times=lambda c: c["dot"] / c["cross"])
    if seen.empty:
        raise LackingRowsError(
            "no wrong length of the run changes the dot form by more than 1/255",
            "measure larger exponents: phongbench run, or with --alpha 50,200",
        )
    least = seen.groupby("alpha")["times"].min()
    good = [float(alpha) for alpha in least.index[least >= MUCH]]
    worst = seen.sort_values(["times", *_CELL], kind="stable").iloc[0]
    return {
        "against": "dot",
        "times_less": MUCH,
        "alphas": good,
        "alpha_from": good[0] if good else None,
        "alphas_measured": [float(alpha) for alpha in least.index],
        "least_times": float(worst["times"]),
        "least_alpha": float(worst["alpha"]),
        "least_perturbation": str(worst["perturbation"]),
        "least_length_error": float(worst["length_error"]),
        "gamma": int(cells["gamma"].iloc[0]),
    }


def _against_difference(mine: pd.DataFrame) -> Record:
    """Who changes less, of what can be seen; by the length error times alpha, on which it depends.

    Up to `difference_to` difference changes no more than cross at every exponent, from `cross_from` on cross changes
    less; None where there is no such end.
    """
    seen = mine[mine[["difference", "cross"]].max(axis=1) > VISIBLE]
    reach, better = seen["alpha"] * seen["length_error"].abs(), seen["difference"] <= seen["cross"]
    first, last = reach[~better].min(), reach[better].max()
    below, beyond = reach[reach < first] if (~better).any() else reach, reach[reach > last] if better.any() else reach
    way = str(mine["perturbation"].iloc[0])
    return {
        "against": "difference",
        "perturbation": way,
        "cross_never_worse": not better.any(),
        "difference_never_worse": bool(better.all()),
        "difference_to_alpha_times_error": float(below.max()) if len(below) else None,
        "cross_from_alpha_times_error": float(beyond.min()) if len(beyond) else None,
        "law_alpha_times_error": error_laws.length_crossover(1.0) if way == "a" else None,
        "largest_length_error": float(mine["length_error"].abs().max()),
    }


def _because(records: list[Record]) -> str:
    first = records[0]
    where = exponents(first["alphas"], first["alphas_measured"])
    start = f"at gamma {first['gamma']}, wrong lengths change cross at most a quarter as much as dot at {where}"
    least = f"(least {times(first['least_times'])} times less, alpha {first['least_alpha']:g})"
    return sentence(f"{start} {least}", *(_who(one) for one in records[1:]))


def _who(one: Record) -> str:
    """Which of difference and cross changes less for one kind of wrong lengths."""
    way = {"a": "one wrong vector", "both": "both vectors alike", "opposite": "both opposite"}[one["perturbation"]]
    low, high = one["difference_to_alpha_times_error"], one["cross_from_alpha_times_error"]
    if one["difference_never_worse"]:
        return f"for {way} difference never changes more than cross"
    if one["cross_never_worse"]:
        return f"for {way} cross changes less than difference"
    if low is None or high is None:
        return f"for {way} now one, now the other of difference and cross changes less"
    law = one["law_alpha_times_error"]
    crossing = "" if law is None else f" (by law at {law:.3g} / alpha)"
    ends = f"up to {low:.3g} / alpha, cross from {high:.3g} / alpha on"
    return f"for {way} difference changes less than cross {ends}{crossing}"


def _rows(rows: Rows, cells: pd.DataFrame, records: list[Record]) -> tuple[Record, ...]:
    """All forms where cross gains least on dot, and with one vector wrong next to the crossover."""
    first = records[0]
    picked = [{column: first[f"least_{column}"] for column in ("alpha", "perturbation", "length_error")}]
    one = at(cells, perturbation="a", alpha=max(first["alphas_measured"]))
    if len(one) and "difference" in one:
        near = one.assign(gap=(one["difference"] / one["cross"] - 1.0).abs()).sort_values(["gap", *_CELL]).iloc[0]
        picked.append({column: near[column] for column in ("alpha", "perturbation", "length_error")})
    source = _source(rows)
    return tuple(row for keys in picked for row in evidence("accuracy", "length_max", at(source, **keys)))


CLAIM = Claim(
    "c",
    "The cross form is much less sensitive to errors of normalisation in R and V than the dot product",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy", "timing"),
    "stability",
    across=("alphas",),
)
