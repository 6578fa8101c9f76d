"""When leaving out dark pairs pays in a vectorised kernel: the blocked variant beside the plain one."""

import pandas as pd

from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.text import INTERVAL, interval, listed, number, records, share, span

PLAIN, SKIP = "-plain", "-skip"
_KEY = ["formula", "lambda_form", "gamma", "working_set", "lit"]


def skipped(study: Rows) -> Table | Absent:
    """Ratios to exact Phong of the plain and the skipping kernel at each lit share; both give the same bits."""
    timing = study.timing
    rows = timing[timing["lit"].notna()] if "lit" in timing else timing.head(0)
    rows = rows[rows["precision"] == study.precision] if len(rows) else rows
    if rows.empty:
        return Absent("The run did not time skipping.", "Run with --preset standard.")
    plain, skip = (_variant(rows, suffix) for suffix in (PLAIN, SKIP))
    data = plain.merge(skip, on=_KEY, suffixes=("_plain", "_skip")).sort_values(_KEY, kind="stable", ignore_index=True)
    certain = data[data["ratio_high_skip"] < data["ratio_low_plain"]]
    body = tuple(
        (
            str(row["formula"]),
            share(float(row["lit"])),
            str(row["working_set"]),
            number(row["ratio_plain"]),
            interval(row["ratio_low_plain"], row["ratio_high_plain"]),
            number(row["ratio_skip"]),
            interval(row["ratio_low_skip"], row["ratio_high_skip"]),
        )
        for row in records(data)
    )
    headings = ("formula", "lit", "working set", "plain", INTERVAL, "skipping", INTERVAL)
    return Table(headings, body, data, _sentence(data, certain), _basis(rows), frozenset(range(3, 7)))


def _variant(rows: pd.DataFrame, suffix: str) -> pd.DataFrame:
    mine = rows[rows["approximation"].str.endswith(suffix)]
    named = mine.assign(formula=mine["approximation"].str.removesuffix(suffix))
    return named[[*_KEY, "ratio", "ratio_low", "ratio_high"]]


def _sentence(data: pd.DataFrame, certain: pd.DataFrame) -> str:
    parts = []
    for name in sorted(data["formula"].unique()):
        shares = sorted(certain.loc[certain["formula"] == name, "lit"].unique())
        where = listed(share(float(part)) for part in shares)
        parts.append(f"{name}: {f'certainly faster at {where} lit' if shares else 'never certainly faster'}")
    return f"Skipping blocks of dark pairs, time against not skipping: {'; '.join(parts)}."


def _basis(rows: pd.DataFrame) -> str:
    pairs = "the same pairs, the lit ones lying together"
    return f"time / exact Phong on {pairs}; bit-identical values; {span(rows['rounds'])} rounds"
