"""What really makes lengths wrong, and what each cause does to a highlight, per lambda form and against both truths."""

from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import STABILITY_ALPHA, Rows
from phongbench.inputs.length_errors import BY_NAME
from phongbench.results.schema import CELL
from phongbench_reports.figures.measured import finished, lyon, setting_of
from phongbench_reports.plots import FORMS, Plate, budget_lines, sheet
from phongbench_reports.table import Absent
from phongbench_reports.text import BUDGETS, alpha_is, listed, number, percent, records
from phongbench_reports.ticks import fixed_ticks, log_axis

#: Columns of the panels: (column, truth, title).
PANELS = (
    ("length_max", "angle", "change by the lengths alone"),
    ("max_abs", "angle", "against the true angle"),
    ("max_abs", "given", "against the vectors as given"),
)
#: The smallest size drawn; what is smaller, or 0, stands at the edge.
FLOOR = 1e-6
#: Heights of the lambda forms around the line of their cause.
_LIFT = {"dot": -0.2, "difference": 0.0, "cross": 0.2, "tan2": 0.36}


def rows_of(study: Rows) -> pd.DataFrame:
    """Lyon with Taylor slope at one exponent and the gamma nearest to 64, every cause, both truths."""
    rows = lyon(
        study.accuracy,
        alpha=STABILITY_ALPHA,
        gamma=64,
        gated=True,
        precision=study.precision,
        stratum="lengths",
        perturbation=tuple(BY_NAME),
        lambda_form=tuple(FORMS),
    )
    columns = [*CELL, "alpha", "perturbation", "length_error", "truth", "length_max", "max_abs", "samples", "coverage"]
    order = rows[columns].assign(size=-rows["length_error"].abs())
    order = order.sort_values(["size", "perturbation", "lambda_form", "truth"], kind="stable")
    return order.drop(columns="size").reset_index(drop=True)


def _panel(axes: Axes, rows: pd.DataFrame, causes: list[str], column: str) -> None:
    for form, (colour, marker, _) in FORMS.items():
        mine = rows[rows["lambda_form"] == form]
        heights = [causes.index(name) + _LIFT.get(form, 0.0) for name in mine["perturbation"]]
        if len(mine):
            sizes = mine[column].clip(lower=FLOOR)
            axes.plot(sizes, heights, color=colour, marker=marker, linestyle="none", label=form)


def draw(study: Rows) -> Plate | Absent:
    """One line a cause, the largest length error on top; a dot for each lambda form; three measures side by side."""
    data = rows_of(study)
    if data.empty:
        return Absent("The run holds no lyon rows on vectors that a real cause made wrong.", "Run with --only lyon.")
    causes = list(dict.fromkeys(data["perturbation"]))
    figure, panels = sheet(
        1.5 + 0.42 * len(causes), 1, 3, left=0.305, wspace=0.07, bottom=0.155, top=0.88, sharey=True, sharex=True
    )
    largest = data.drop_duplicates("perturbation").set_index("perturbation")["length_error"]
    for axes, (column, truth, title) in zip(panels, PANELS, strict=True):
        log_axis(axes.xaxis, labels=5)
        budget_lines(axes, vertical=True, named=column == "length_max")
        _panel(axes, data[data["truth"] == truth], causes, column)
        axes.set_title(title, pad=6, fontsize=8.5)
    panels[0].set_xlim(FLOOR / 1.5, max(1.0, 1.5 * float(data[["length_max", "max_abs"]].to_numpy().max())))
    panels[0].set_ylim(len(causes) - 0.4, -0.75)
    names = [f"{BY_NAME[name].text}\n{percent(largest[name])}" for name in causes]
    fixed_ticks(panels[0].yaxis, range(len(causes)), names)
    panels[0].tick_params(axis="y", labelsize=8)
    marks = panels[0].get_legend_handles_labels()
    look: dict[str, Any] = {"fontsize": 8, "title_fontsize": 8, "labelcolor": "linecolor", "borderaxespad": 0.4}
    figure.legend(*marks, loc="upper left", bbox_to_anchor=(0.0, 1.0), title="lambda form", **look)
    figure.text(0.64, 0.065, "largest absolute error", ha="center", fontsize=9)
    note = f"{setting_of(study, data)}; under each cause its largest length error; marks at the left edge: smaller"
    return finished(study, figure, data, note, _sentence(data, causes), _alt(data, causes))


def _sentence(data: pd.DataFrame, causes: list[str]) -> str:
    """For each form the causes whose change stays within one 8-bit code."""
    code, name = BUDGETS[0]
    angle = data[data["truth"] == "angle"]
    parts = []
    for form in FORMS:
        mine = angle[angle["lambda_form"] == form]
        if len(mine):
            good = [row["perturbation"] for row in records(mine) if row["length_max"] <= code]
            parts.append(f"{form} {len(good)}")
    return (
        f"Of {len(causes)} real causes of wrong lengths, so many change the highlight by at most {name} "
        f"at {alpha_is(data['alpha'].iloc[0])}: {listed(parts)}."
    )


def _alt(data: pd.DataFrame, causes: list[str]) -> str:
    parts = []
    for cause in causes:
        mine = data[(data["perturbation"] == cause) & (data["truth"] == "angle")]
        sizes = ", ".join(f"{row['lambda_form']} {number(row['length_max'])}" for row in records(mine))
        parts.append(f"{BY_NAME[cause].text}: {sizes}")
    return f"Dot charts of the error by cause and lambda form. Change by the lengths alone: {'; '.join(parts)}."
