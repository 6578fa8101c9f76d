"""What each step from raw vectors to a highlight costs: a bar each, as a share of exact Phong's time."""

import numpy as np
import pandas as pd

from phongbench.analysis.raw_vectors import steps
from phongbench.analysis.rows import Rows, at
from phongbench.results.records import Records
from phongbench.results.schema import DOT
from phongbench_reports.figures.speed import SETS
from phongbench_reports.plots import BLUE, INK, Plate, footnote, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import INTERVAL, interval, number, records, span, time_it
from phongbench_reports.ticks import fixed_ticks


def costs(study: Rows) -> pd.DataFrame:
    """The bare dot product, then each step: columns of `raw_vectors.steps`; only those that have an interval."""
    times = study.raw_times
    here = at(times, precision=study.precision, working_set=study.working_set)
    bare = [
        {"step": "a.b alone", "what": "read two vectors, write a number", "with": DOT, "without": "nothing"}
        | {"ns": row["ns_min"], "share": row["ratio"], "share_low": row["ratio_low"], "share_high": row["ratio_high"]}
        for row in records(at(here, approximation=DOT))
    ]
    found = pd.DataFrame([*bare, *steps(Records.of(here), working_set=study.working_set, precision=study.precision)])
    if found.empty:
        return found
    sure = np.isfinite(found[["share_low", "share_high"]].to_numpy(float)).all(axis=1)
    kept: pd.DataFrame = found.loc[sure]
    return kept


def draw(study: Rows) -> Plate | Absent:
    """Horizontal bars with the interval of each, in the smallest timed working set."""
    if study.raw("timing").empty:
        return Absent("This run has no timing, so no step has a cost.", time_it(study))
    data = costs(study)
    if len(data) <= 2:  # the dot product and the power alone
        return Absent("The run timed no step of a highlight from raw vectors.", "Run a preset, which holds such steps.")
    height = 0.95 + 0.36 * len(data)
    figure, (axes,) = sheet(height, left=0.2, right=0.8, top=1 - 0.15 / height, bottom=0.72 / height)
    middle, places = data["share"].to_numpy(float), np.arange(len(data))
    ends = np.abs([middle - data["share_low"].to_numpy(float), data["share_high"].to_numpy(float) - middle])
    axes.barh(places, middle, height=0.6, color=BLUE, xerr=ends, error_kw={"ecolor": INK, "elinewidth": 1.0})
    fixed_ticks(axes.yaxis, places, data["step"].tolist())
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_xlabel(f"share of exact Phong's time, {SETS[study.working_set]}")
    for place, row in enumerate(records(data)):
        told = f"{number(row['ns'], 2)} ns, {_whole(row['share'])}"
        axes.text(1.02, place, told, transform=axes.get_yaxis_transform(), va="center", fontsize=8)
    rounds = at(study.raw_times, precision=study.precision, working_set=study.working_set)["rounds"]
    source = f"{span(rounds)} rounds, 1 thread"
    footnote(figure, f"{study.precision}, differences of two kernels' times with what both {INTERVAL}s allow; {source}")
    return Plate(figure, data, _sentence(study, data), _alt(data), source, "phongbench run")


def _whole(part: float) -> str:
    """A share in whole percent; a step may take more than exact Phong itself."""
    return f"{100 * part:.0f}\u00a0%"


def _sentence(study: Rows, data: pd.DataFrame) -> str:
    if study.twin_differs:
        return "The A/A twin differs from itself in this run, so no cost is claimed from these bars."
    sure = data[(data["share_low"] > 0) & (data["step"] != "a.b alone")]
    if sure.empty:
        return "No step costs surely more than nothing in this run."
    dear = records(sure.sort_values("share", kind="stable"))[-1]
    unsure = len(data) - 1 - len(sure)
    rest = f"; {unsure} of {len(data) - 1} steps cannot be told from nothing" if unsure else ""
    return f"The dearest step is {dear['step']}: {_whole(dear['share'])} of exact Phong's time{rest}."


def _alt(data: pd.DataFrame) -> str:
    told = [f"{r['step']} {number(r['share'])} ({interval(r['share_low'], r['share_high'])})" for r in records(data)]
    return f"Bars, share of exact Phong's time for each step: {'; '.join(told)}."
