"""The tables of the report: the verdict, the census of strange values, the worst inputs."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from phongbench.analysis.choice import Choice
from phongbench.analysis.promises import DOMAIN
from phongbench.analysis.rows import Rows, at
from phongbench.results.frames import strongest
from phongbench.results.schema import CELL
from phongbench_reports.figures.speed import SETS
from phongbench_reports.names import title
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import INTERVAL, alpha_is, basis, counted, interval, label, number, records, time_it

#: Rows of a long table that the page shows; the CSV holds all.
SHOWN = 24
COUNTS = {"above_one": "above 1", "negative": "negative", "nonfinite": "not finite", "excluded": "left out"}


def _gain(row: Mapping[str, Any] | None, *, withheld: bool) -> tuple[str, str]:
    """How many times faster than exact Phong, and the interval of that; words where nothing may be claimed."""
    if row is None:
        return "–", "–"
    if withheld:
        return "withheld", "–"
    low, high = 1.0 / float(row["ratio_high"]), 1.0 / float(row["ratio_low"])
    return f"{number(1.0 / float(row['ratio']))} ×", interval(low, high)


def _rival(choice: Choice, *, withheld: bool) -> str:
    if choice.best is None:
        miss = choice.nearest_miss
        return "–" if miss is None else f"nearest miss: {label(miss)}, {_codes(miss)}"
    if choice.runner_up is None:
        return "no other fits"
    if withheld:
        return label(choice.runner_up)
    how = "slower" if choice.resolved else "unresolved"
    return f"{label(choice.runner_up)} ({how})"


def _codes(miss: Mapping[str, Any]) -> str:
    """How far a miss may err; what it was measured at where nothing is promised of it."""
    if math.isfinite(miss["bound"]):
        return f"up to {number(255 * float(miss['bound']))} codes"
    return f"sampled {number(255 * float(miss['error']))} codes, not promised"


def verdict(study: Rows, precision: str, budget: float, name: str) -> Table | Absent:
    """For each swept exponent the cheapest formula within the budget, with its time against exact Phong.

    It is the answer of `recommend`: what is compared with the budget is a promise, not a largest sample.
    budget   float   largest absolute error allowed
    name     str     the budget in words, "1/255"
    """
    if not len(at(study.highlight, precision=precision, space="reflect")):
        return Absent(f"Nothing was measured at {precision}.", f"Run with --precision {precision}.")
    if study.timing.empty or not (study.timing["precision"] == precision).any():
        return _accuracy_only(study, precision, budget, name)
    withheld = bool(study.twin_differs)
    candidates = at(study.highlight, space="reflect", precision=precision)
    rows, data = [], []
    for alpha in sorted(candidates["alpha"].unique()):
        choice = study.choices.choice(float(alpha), precision, budget)
        best = choice.best
        gain, ends = _gain(best, withheld=withheld)
        bound, ns = (None, None) if best is None else (float(best["bound"]), float(best["ns"]))
        formula = "nothing fits" if best is None else label(best)
        codes = "–" if bound is None else number(255 * bound)
        rows.append((f"{alpha:g}", formula, codes, number(ns), gain, ends, _rival(choice, withheld=withheld)))
        data.append(_verdict_row(alpha, choice))
    headings = ("α", "formula", "at most, 8-bit codes", "ns / element", "faster than exact", INTERVAL, "runner-up")
    source = f"{precision}, vectors {SETS[study.working_set]}; errors: proven bounds for {DOMAIN}"
    source = f"{source}; {_half_space(study, precision)}"
    source = f"{source}; unresolved: the intervals overlap"
    frame = pd.DataFrame(data)
    sentence = _verdict_sentence(frame, name, withheld=withheld)
    return Table(headings, tuple(rows), frame, sentence, source, frozenset({0, 2, 3, 4, 5}))


def _half_space(study: Rows, precision: str) -> str:
    """Why no formula of (N, H) is in the table: what the best of them errs by."""
    rows = at(study.half_space, precision=precision)
    rows = rows[rows["nonfinite"] == 0].sort_values(["max_abs", "alpha", *CELL], kind="stable")
    if rows.empty:
        return "formulas of (N, H) are left out: this run measured them on coplanar vectors only"
    best = rows.iloc[0]
    named = f"{label(best)} at {alpha_is(best['alpha'])}"
    return (
        "formulas of (N, H), another lobe, are not among them: over all configurations of N, L and V the nearest, "
        f"{named}, was sampled to err by {number(255 * float(best['max_abs']))} codes"
    )


def _verdict_row(alpha: float, choice: Choice) -> dict[str, Any]:
    best = {} if choice.best is None else {str(k): v for k, v in choice.best.items() if k != "state"}
    rival = None if choice.runner_up is None else label(choice.runner_up)
    miss = None if choice.nearest_miss is None else label(choice.nearest_miss)
    empty = dict.fromkeys([*CELL, "error", "bound", "coverage", "ns", "ratio", "ratio_low", "ratio_high"])
    return {"alpha": alpha, **empty, **best, "runner_up": rival, "resolved": choice.resolved, "nearest_miss": miss}


def _verdict_sentence(data: pd.DataFrame, name: str, *, withheld: bool) -> str:
    if withheld:
        return "The A/A twin differs from itself: this run's speed claims are withheld, only errors count."
    faster = data[(data["approximation"] != "phong") & (data["ratio_high"].astype(float) < 0.98)]
    count = f"{len(faster)} of {counted(len(data), 'exponent')}"
    start = f"Within {name}, a formula is certainly faster than exact Phong at {count}"
    if faster.empty:
        return f"{start}."
    best = faster.sort_values(["ratio", "alpha"], kind="stable").iloc[0]
    where = f"{label(best)} at {alpha_is(best['alpha'])}"
    return f"{start}; the largest gain is {number(1 / float(best['ratio']))} times, {where}."


def _accuracy_only(study: Rows, precision: str, budget: float, name: str) -> Table:
    """The verdict without times: what samples allow, the fewest squarings of that, what errs least; no promise."""
    rows, data = [], []
    unit = at(study.highlight, precision=precision, space="reflect")
    for alpha in study.alphas:
        cells = unit[(unit["alpha"] == alpha) & (unit["approximation"] != "phong")]
        cells = cells.sort_values(["max_abs", *CELL], kind="stable")
        good = cells[cells["max_abs"] <= budget]
        few = good[good["gamma"].notna()].sort_values("gamma", kind="stable").head(1)
        fits, fewest = len(good), label(few.iloc[0]) if len(few) else "–"
        best = cells.iloc[0] if len(cells) else None
        least = ("–", "–", "–") if best is None else (label(best), number(best["max_abs"]), number(best["codes_8bit"]))
        rows.append((f"{alpha:g}", fewest, f"{fits} of {len(cells)}", least[0], least[2]))
        error = None if best is None else float(best["max_abs"])
        data.append(
            {"alpha": alpha, "fewest": fewest, "within": fits, "cells": len(cells), "least": least[0], "error": error}
        )
    fewest, count = f"fewest squarings sampled below {name}", f"cells sampled below {name}"
    headings = ("α", fewest, count, "errs least", "its error, 8-bit codes")
    lacking = "This run has no timing" if study.timing.empty else f"Nothing was timed at {precision}"
    fix = f" {time_it(study)}" if study.timing.empty else ""
    sentence = f"{lacking}: the table says what samples allow, which is not promised, not what is cheapest.{fix}"
    note = f"{precision}; {basis(unit)}"
    return Table(headings, tuple(rows), pd.DataFrame(data), sentence, note, frozenset({0, 2, 4}))


def census(study: Rows) -> Table | Absent:
    """Counts of values above 1, negative, not finite or left out, per formula, form, precision and stratum."""
    keys = ["approximation", "lambda_form", "space", "precision", "gated", "stratum"]
    present = [column for column in COUNTS if column in study.accuracy.columns]
    rows = strongest(study.accuracy[study.accuracy["truth"] == "angle"])
    grouped = rows.groupby(keys, sort=True, observed=True)[[*present, "samples"]].sum().reset_index()
    strange = grouped[(grouped[present] > 0).any(axis=1)]
    clean = len(grouped) - len(strange)
    sentence = f"{clean} of {len(grouped)} groups of cells hold no such value"
    if strange.empty:
        return Absent(f"No value above 1, negative or not finite in any of {len(grouped)} groups of cells.", "")
    totals = ", ".join(f"{number(int(strange[column].sum()))} {COUNTS[column]}" for column in present)
    order = strange.assign(share=strange[present].sum(axis=1) / strange["samples"])
    order = order.sort_values(["share", *keys], ascending=[False] + [True] * len(keys), kind="stable")
    shown = order[order["precision"] == study.precision].head(SHOWN)
    body = tuple(
        (
            label({**row, "gamma": None}),
            str(row["precision"]),
            "yes" if row["gated"] else "no",
            str(row["stratum"]),
            number(row["samples"]),
            *(number(row[column]) for column in present),
        )
        for row in records(shown)
    )
    headings = ("formula", "precision", "gated", "stratum", "samples", *(COUNTS[column] for column in present))
    numeric = frozenset(range(4, len(headings)))
    note = f"{len(shown)} of {len(order)} groups shown, {study.precision}, largest share first; all in the CSV"
    return Table(
        headings,
        body,
        order.drop(columns="share").reset_index(drop=True),
        f"{sentence}; in the rest: {totals}.",
        note,
        numeric,
    )


def _vector(row: dict[str, Any], letter: str) -> str:
    return ", ".join(str(row[f"{letter}{axis}"]) for axis in "xyz")


def worst(study: Rows) -> Table | Absent:
    """The worst input of each formula and form as C99 hex floats, with the command that finds it again.

    The page prefers gated unit vectors, where a formula's own faults lie: wrong lengths err beyond all measure.
    """
    rows = study.worst
    if rows.empty:
        return Absent("This run kept no worst inputs.", "Run again; they are kept with every accuracy row.")
    ranked = rows.sort_values(["error", *CELL, "alpha", "stratum", "rank"], key=_by_size, kind="stable")
    mine = ranked[ranked["precision"] == study.precision]
    fault = mine["stratum"].isin(["lengths", "hostile", "mesh"]) * 2 + ~mine["gated"].astype(bool)
    each = mine.assign(fault=fault.astype(int)).sort_values("fault", kind="stable")
    each = each.drop_duplicates(["approximation", "lambda_form", "space"]).drop(columns="fault").head(SHOWN)
    body, details = [], []
    for index, row in zip(each.index, records(each), strict=True):
        gate = "" if row.get("gated", True) else ", ungated"
        numbers = (number(row["error"]), number(row["value"]), number(row["exact"]))
        body.append((label(row), f"{row['alpha']:g}", str(row["precision"]), f"{row['stratum']}{gate}", *numbers))
        pair = (f"a = ({_vector(row, 'a')})", f"b = ({_vector(row, 'b')})")
        details.append((*pair, reproduce(study, each.loc[[index]])))
    top = each.iloc[0]  # not the run's: that of some overflowing vector is as large as numbers go, and says nothing
    where = f"{label(top)} at {alpha_is(top['alpha'])}, {top['precision']}, stratum {top['stratum']}"
    sentence = f"The largest error of those shown is {number(top['error'])}: {where}."
    headings = ("formula", "α", "precision", "stratum", "error", "value", "exact")
    note = f"{study.precision}, worst of each formula and form, unit vectors first; "
    note += f"all {number(len(rows))} in the run's worst.parquet"
    return Table(headings, tuple(body), each, sentence, note, frozenset({1, 4, 5, 6}), frozenset(), tuple(details))


def _by_size(column: pd.Series) -> pd.Series:
    return -column.abs() if column.name == "error" else column


def formulas(study: Rows) -> Table:
    """The formulas of the run with their titles: what the short names of figures stand for."""
    names: Sequence[str] = sorted(study.accuracy["approximation"].unique())
    cells = study.highlight[study.highlight["precision"] == study.precision].drop_duplicates(["alpha", *CELL])
    per_name = cells.groupby("approximation").size()
    rows = tuple((name, *title(name), number(int(per_name.get(name, 0)))) for name in names)
    headings = ("name", "title", "kind", "formula", "source", "cells")
    data = pd.DataFrame(rows, columns=list(headings))
    return Table(headings, rows, data, f"{len(names)} formulas were measured.", "", frozenset({5}), frozenset({0, 3}))
