"""What was measured on an adapter of this machine: time, in and out of other work, errors, and a model beside it."""

from typing import Any

from phongbench.analysis.adapter import family_of, measured
from phongbench.analysis.rows import Rows
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.sureness import headline
from phongbench_reports.text import label, missing, number, records

#: columns beside the formula: heading, and what it shows of a row
_TIMES: tuple[tuple[str, str], ...] = (("ns", "ns"), ("/ exact Phong", "ratio"))
_ERRORS = (("error, float32", "float32"), ("error, float16", "float16"))


def adapter(study: Rows) -> Table | Absent:
    """The formulas that were timed on the adapter, cheapest first."""
    data = measured(study)
    if data.empty:
        return Absent("No GPU was measured.", "Run with --target gpu where WebGPU finds one.")
    about = study.run.manifest["gpu"]
    contexts = [name for name in data.columns if name.startswith("in_") and data[name].notna().any()]
    around = [(f"ns amid {name.removeprefix('in_')}", name) for name in contexts]
    around += [("ns, reading", "reading")] if data["reading"].notna().any() else []
    family = family_of(about["adapter"])
    model = [(f"{family}, compiled", "model"), ("measured / compiled", "off")] if data["off"].notna().any() else []
    shown = [*_TIMES, *around, *model, *((title, name) for title, name in _ERRORS if data[name].notna().any())]
    rows = tuple(
        (label(row), *(_cell(row, name) for _, name in shown)) for row in records(headline(data).sort_values("ratio"))
    )
    basis = (
        f"{about['tool']} ({about['tool_version']}), {about['rounds']} rounds; in brackets the 99 % interval. Amid so "
        "many multiply-adds of other work, or reading memory: what it adds there; near 0 it no longer matters. "
        "Errors are of the code that was timed, on unit vectors, the largest that samples, a search or every cosine "
        "show on this device"
    )
    twin = "" if about["twin"] == "unresolved" else " Identical code was told apart, so no time is to be trusted."
    headings = ("formula", *(title for title, _ in shown))
    return Table(headings, rows, data, f"{_sentence(study, data)}{twin}", basis, frozenset(range(1, len(headings))))


def _cell(row: Any, name: str) -> str:
    if missing(row[name]):
        return "–"
    if name == "ratio" and not missing(row["ratio_low"]):
        return f"{number(row[name])} [{number(row['ratio_low'])}, {number(row['ratio_high'])}]"
    return number(row[name], 3)


def _sentence(study: Rows, data: Any) -> str:
    """What it is, which formula is the fastest, and how far the model is off."""
    best = records(data)[0]
    where = study.run.manifest["gpu"]["adapter"]
    told = f"On {where}: {label(best)} takes {number(best['ratio'])} of exact Phong's time, the least"
    off = data["off"].dropna()
    if off.empty:
        return f"{told}."
    return (
        f"{told}; measured ratios are {number(off.min())} to {number(off.max())} times those of its compiler's model."
    )
