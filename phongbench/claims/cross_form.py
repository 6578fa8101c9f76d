"""Claim c: the cross form is much less sensitive to normalisation."""

from __future__ import annotations

import pandas as pd

from phongbench import laws
from phongbench.claims.claim import CONDITIONS, FAILS, HOLDS, VISIBLE, Claim, Finding, LackingRowsError, Numbers
from phongbench.claims.cuts import KEY, Rows, at, coverage, evidence, near_gamma
from phongbench.claims.words import exponents, sentence
from phongbench.sources import WIKIPEDIA_PHONG

#: much less: at most a quarter of the change
MUCH = 4.0
#: the gamma that is judged, or the measured one nearest to it
GAMMA = 8
#: ways in which lengths of two vectors are wrong
WAYS = ("a", "both", "opposite")
FORMS = ("dot", "difference", "cross")
_CELL = [column for column in KEY if column != "lambda_form"]


def judge(rows: Rows) -> Finding:
    """What wrong lengths alone change in Lyon's formula, slope alpha / gamma, gamma 8: one vector, both alike, and both
    opposite. Against dot: the cross form is much less sensitive at an exponent if, wherever dot changes by more than
    1/255, cross changes by at most a quarter of that. Against difference: for one wrong vector, up to which length
    error, times alpha, difference changes no more than cross, and from which on cross does.
    Holds if cross is much less sensitive than dot at every measured exponent and nowhere more sensitive than
    difference; fails if it is so at no exponent; else holds under conditions.
    """
    cells = _compared(rows)
    told = [_against_dot(cells)]
    if "difference" in cells:
        told += [_against_difference(mine) for way in WAYS if len(mine := at(cells, perturbation=way))]
    good, measured = told[0]["alphas"], told[0]["alphas_measured"]
    safest = all(record["cross_never_worse"] for record in told[1:])
    verdict = FAILS if not good else HOLDS if good == measured and safest else CONDITIONS
    return Finding(verdict, _because(told), tuple(told), _rows(rows, cells, told), coverage(_source(rows)))


def _source(rows: Rows) -> pd.DataFrame:
    cells = at(
        rows.lengths, approximation="lyon", space="reflect", beta_policy="taylor", lambda_form=FORMS, perturbation=WAYS
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
            None,
            'measure them: phongbench run, with "lengths" among the strata and dot,cross among --lambda',
        )
    return wide.sort_values(_CELL, kind="stable").reset_index(drop=True)


def _against_dot(cells: pd.DataFrame) -> Numbers:
    seen = cells[cells["dot"] > VISIBLE].assign(times=lambda c: c["dot"] / c["cross"])
    least = seen.groupby("alpha")["times"].min()
    good = [float(alpha) for alpha in least.index[least >= MUCH]]
    worst = seen.sort_values(["times", *_CELL], kind="stable").iloc[0] if len(seen) else None
    return {
        "against": "dot", "times_less": MUCH, "alphas": good, "alpha_from": good[0] if good else None,
        "alphas_measured": [float(alpha) for alpha in least.index],
        "least_times": None if worst is None else float(worst["times"]),
        "least_alpha": None if worst is None else float(worst["alpha"]),
        "least_perturbation": None if worst is None else str(worst["perturbation"]),
        "least_length_error": None if worst is None else float(worst["length_error"]),
        "gamma": int(cells["gamma"].iloc[0]),
    }  # fmt: skip


def _against_difference(mine: pd.DataFrame) -> Numbers:
    """Length error times alpha up to which difference changes no more than cross at every exponent, and from which
    on it changes more; only where either change is visible.
    """
    seen = mine[mine[["difference", "cross"]].max(axis=1) > VISIBLE]
    reach, better = (seen["alpha"] * seen["length_error"].abs()), seen["difference"] <= seen["cross"]
    crossed, stayed = reach[~better].min(), reach[better].max()
    way = str(mine["perturbation"].iloc[0])
    return {
        "against": "difference", "perturbation": way, "cross_never_worse": not better.any(),
        "difference_never_worse": bool(better.all()),
        "difference_better_to_alpha_times_error": float(reach[better & (reach < crossed)].max())
        if (~better).any() else float(stayed),
        "cross_better_from_alpha_times_error": float(reach[~better & (reach > stayed)].min())
        if better.any() else float(crossed),
        "law_alpha_times_error": laws.length_crossover(1.0) if way == "a" else None,
        "largest_length_error": float(mine["length_error"].abs().max()),
    }  # fmt: skip


def _because(told: list[Numbers]) -> str:
    first = told[0]
    where = exponents(first["alphas"], first["alphas_measured"])
    parts = [f"at gamma {first['gamma']}, wrong lengths change cross at most a quarter as much as dot at {where}"]
    if first["least_times"] is not None:
        parts[0] += f" (least {first['least_times']:.2g} times less, alpha {first['least_alpha']:g})"
    for one in told[1:]:
        if one["perturbation"] == "a" and not one["cross_never_worse"] and not one["difference_never_worse"]:
            low, high = (
                one["difference_better_to_alpha_times_error"],
                one["cross_better_from_alpha_times_error"],
            )
            parts.append(
                f"difference changes still less for one vector wrong by up to {low:.3g} / alpha, cross from "
                f"{high:.3g} / alpha on (by law at {one['law_alpha_times_error']:.3g} / alpha)"
            )
        elif one["perturbation"] == "both" and one["difference_never_worse"]:
            parts.append("difference always does for both alike")
        elif one["perturbation"] == "opposite" and one["cross_never_worse"]:
            parts.append("cross does for both opposite")
    return sentence(*parts)


def _rows(rows: Rows, cells: pd.DataFrame, told: list[Numbers]) -> tuple[Numbers, ...]:
    """All forms where cross gains least on dot, and with one vector wrong next to the crossover."""
    first, picked = told[0], []
    if first["least_alpha"] is not None:
        names = {"alpha": "least_alpha", "perturbation": "least_perturbation", "length_error": "least_length_error"}
        picked.append({column: first[name] for column, name in names.items()})
    one = at(cells, perturbation="a", alpha=max(first["alphas_measured"], default=None))
    if len(one) and "difference" in one:
        near = one.assign(gap=(one["difference"] / one["cross"] - 1.0).abs()).sort_values(["gap", *_CELL]).iloc[0]
        picked.append({column: near[column] for column in ("alpha", "perturbation", "length_error")})
    source = _source(rows)
    found = [evidence("accuracy", "length_max", at(source, **keys)) for keys in picked]
    return tuple(row for part in found for row in part)


CLAIM = Claim(
    "c",
    "The cross form is much less sensitive to errors of normalisation in R and V than the dot product",
    WIKIPEDIA_PHONG,
    judge,
    ("accuracy",),
    "stability",
)
