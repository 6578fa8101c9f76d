"""The tables of behaviour: what formulas make of hostile input, and how smooth their lobes are."""

from collections.abc import Collection

import pandas as pd

from phongbench.analysis.rows import Rows, near, ordered
from phongbench_reports.figures.measured import lyon
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import alpha_is, label, number, records

#: Short words for outcomes, as the cells of the table show them; what is well is quiet.
WORDS = {
    "value": "ok",
    "saturates": "0 or 1",
    "nan": "no number",
    "infinite": "∞",
    "above-one": "> 1",
    "negative": "< 0",
    "refused": "refused",
}
#: Outcomes that leave the range of a highlight.
BAD = ("nan", "infinite", "above-one", "negative")
KEY = ["approximation", "lambda_form", "space", "precision", "gated"]


def hostile(study: Rows) -> Table | Absent:
    """A row for each formula and form in the headline precision, a column for each case."""
    rows = study.behaviour
    if rows.empty:
        return Absent("Hostile inputs were not tried.", "Run with the probe hostile, which every preset holds.")
    rows = ordered(rows, [*KEY, "alpha", "case"])
    mine = rows[rows["precision"] == nearest_precision(study, rows)]
    # exponents are tried at three places each: one column shows the worst of them
    named = mine.assign(short=mine["case"].str.replace(r" at .*$", "", regex=True), open=~mine["gated"].astype(bool))
    first_alpha = named.groupby("short")["alpha"].min()  # vectors first, then exponents by size
    cases = sorted(first_alpha.index, key=lambda c: (float(first_alpha[c]) if c.startswith("alpha") else -1.0, c))
    body = []
    for _, cell in named.groupby([*KEY[:-1], "open"], sort=True, observed=True):
        first = records(cell.iloc[:1])[0]
        name = label({**first, "gamma": None, "beta_policy": "none"}) + ("" if first["gated"] else ", ungated")
        outcomes: dict[str, set[str]] = {}
        for case, outcome in zip(cell["short"], cell["outcome"], strict=True):
            outcomes.setdefault(case, set()).add(outcome)
        body.append((name, *(worst(outcomes.get(case, ())) for case in cases)))
    bad = mine[mine["outcome"].isin(BAD)]
    sure = len(named.drop_duplicates(KEY)) - len(bad.drop_duplicates(KEY))
    precision = str(mine["precision"].iloc[0])
    sentence = (
        f"In {precision}, {sure} of {len(body)} formulas and forms stay within 0 and 1 whatever comes in; "
        f"{len(bad)} of {len(mine)} answers are infinite, above 1, negative or no number."
    )
    basis = (
        f"{precision}; ok: a value in range that is not merely 0 or 1 by force, or the exact one; 0 or 1: held there, "
        "where the exact value is another or undefined; all precisions in the run's behaviour.parquet"
    )
    return Table(("formula", *map(_heading, cases)), tuple(body), mine, sentence, basis)


def _heading(case: str) -> str:
    """The case with a minus sign, and an equation that no line end tears apart."""
    return case.replace(" = -", "\u00a0=\u00a0−")


def nearest_precision(study: Rows, rows: pd.DataFrame) -> str:
    """The study's own precision where the rows have it, else the first one that they have."""
    held = set(rows["precision"])
    return study.precision if study.precision in held else sorted(held)[0]


def worst(outcomes: Collection[str]) -> str:
    """The word for the worst of some outcomes; a dash where the case does not arise."""
    order = ["nan", "infinite", "above-one", "negative", "saturates", "value", "refused"]
    return WORDS[min(outcomes, key=order.index)] if len(outcomes) else "–"


def smoothness(study: Rows) -> Table | Absent:
    """Lyon's lobes at the headline exponent, form by form and gamma by gamma: rises in each precision, and the edge."""
    rows = study.smoothness
    if rows.empty:
        return Absent("Smoothness was not measured.", "Run with the probe smoothness, which every preset holds.")
    rows = ordered(rows, [*KEY, "alpha", "gamma", "beta_policy"])
    mine = lyon(near(rows, "alpha", study.alpha), gated=True)
    if mine.empty:
        return Absent("The run holds no lobes of lyon.", "Run with --only lyon.")
    alpha = float(mine["alpha"].iloc[0])
    precisions = [name for name in study.precisions if name in set(mine["precision"])]
    body = []
    for _, cell in mine.groupby(["lambda_form", "gamma"], sort=True, observed=True):
        edge = records(cell.iloc[:1])[0]
        hard = "< 0.001" if edge["kink"] < 1e-3 else number(edge["kink"])
        line = [str(edge["lambda_form"]), str(int(edge["gamma"])), hard, number(edge["kink_degrees"])]
        for row in (row for name in precisions for row in records(cell[cell["precision"] == name])):
            line += [number(row["rises"]), number(255 * row["largest_rise"])]
            line.append(f"{number(row['overflows'])} / {number(row['subnormals'])}")
        body.append(tuple(line))
    headings = ["lambda form", "γ", "edge", "at degrees"]
    for name in precisions:
        headings += [f"{name}: rises", "largest, codes", "overflows / subnormals"]
    return Table(
        tuple(headings),
        tuple(body),
        mine,
        _smooth_sentence(mine, alpha),
        "edge: second difference at the lobe's end over that of exact Phong's peak; about 1 is a Mach band, more is a "
        "kink or a step; rises: places where the lobe grows away from its peak; overflows (in fixed point saturations) "
        f"and subnormals: of lambda or value, in {number(mine['samples'].iloc[0])} samples; "
        "every cell in the run's smoothness.parquet",
        frozenset(range(1, len(headings))),
    )


def _smooth_sentence(mine: pd.DataFrame, alpha: float) -> str:
    visible = mine[mine["kink"] >= 0.1]
    hard = sorted({int(gamma) for gamma in visible["gamma"]})
    soft = sorted({int(gamma) for gamma in mine["gamma"]} - set(hard))
    top = records(mine.sort_values("largest_rise", kind="stable").tail(1))[0]
    edges = f"γ {', '.join(map(str, hard))} shows its edge" if hard else "no γ shows its edge"
    rest = f", γ {', '.join(map(str, soft))} does not" if soft else ""
    return (
        f"At {alpha_is(alpha)} {edges}{rest}; the largest rise away from the peak is "
        f"{number(255 * top['largest_rise'])} codes ({label(top)}, {top['precision']})."
    )
