"""The textbook claims: verdict, reason, the rule, its numbers, and the rows that decide."""

import json
from collections import Counter
from dataclasses import dataclass
from typing import Any

import pandas as pd

from phongbench.analysis.claims import SIGNS, VERDICTS, Judgement, judge
from phongbench.analysis.rows import Rows
from phongbench.errors import InputError
from phongbench_reports.figures import FIGURES
from phongbench_reports.figures.pictures import SECTIONS
from phongbench_reports.reproduce import reproduce
from phongbench_reports.table import Absent
from phongbench_reports.text import label, listed, missing, number

#: verdict -> how a sentence on one claim, and on several, says it
_VERBS = {
    "holds": ("holds", "hold"),
    "holds under conditions": ("holds under conditions", "hold under conditions"),
    "fails mostly": ("fails mostly", "fail mostly"),
    "fails": ("fails", "fail"),
    "not measured": ("was not measured", "were not measured"),
}
#: parts of a row's key that its formula does not hold
_WHERE = (
    "alpha", "precision", "mesh", "edge_degrees", "normals", "pair", "stratum", "perturbation", "length_error",
    "working_set", "coverage", "scene", "depth", "kind", "name", "formula", "setting", "held", "term", "distance",
)  # fmt: skip
_UNSAID = (None, "none", 0.0)
#: anchors that a claim may point to
_SHOWN = {part.name for part in (*FIGURES, *SECTIONS)}


@dataclass(frozen=True)
class Numbers:
    """Conditions of one kind: what all have in common, and a table of the rest."""

    common: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Entry:
    """One claim as the page shows it; plain text throughout.

    figure      anchor of the section that shows it, or ""
    numbers     the conditions of the verdict
    evidence    the rows that decide, a line each
    command     what measures the accuracy rows among them again, or ""
    """

    key: str
    title: str
    source: str
    sign: str
    verdict: str
    because: str
    lacking: str
    rule: str
    figure: str
    numbers: tuple[Numbers, ...]
    evidence: tuple[str, ...]
    command: str


@dataclass(frozen=True)
class ClaimTable:
    """The section's content: entries in the order of their letters; `data` becomes the CSV."""

    entries: tuple[Entry, ...]
    data: pd.DataFrame
    takeaway: str
    basis: str


def claims(study: Rows) -> ClaimTable | Absent:
    """All claims, judged by the rows of the run."""
    try:
        judged = judge(study)
    except InputError as lacking:
        return Absent(f"{lacking.what}.", lacking.fix or "")
    counted = Counter(one.verdict for one in judged)
    parts = [f"{counted[v]} {_VERBS[v][counted[v] != 1]}" for v in VERDICTS if counted[v]]
    sentence = f"Of {len(judged)} textbook claims {listed(parts)}."
    basis = "Verdicts follow from stated rules and this run's rows, or from formulas alone where the coverage is law"
    return ClaimTable(tuple(_entry(study, one) for one in judged), _data(judged), sentence, basis)


def _entry(study: Rows, one: Judgement) -> Entry:
    claim = one.as_dict()
    rows = [row for row in claim["evidence"] if row["table"] == "accuracy"]
    command = reproduce(study, pd.DataFrame(rows).convert_dtypes()) if rows else ""
    lacking = claim["lacking"] or ""
    return Entry(
        claim["key"],
        claim["claim"],
        claim["source"],
        SIGNS[one.verdict],
        one.verdict,
        claim["because"],
        f"{lacking[:1].upper()}{lacking[1:]}",
        claim["rule"],
        claim["figure"] if claim["figure"] in _SHOWN and claim["evidence"] else "",
        _numbers(claim["conditions"]),
        tuple(_row(row) for row in claim["evidence"]),
        command,
    )


def _numbers(records: list[dict[str, Any]]) -> tuple[Numbers, ...]:
    """One table for all records that have the same names."""
    kinds: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for record in records:
        kinds.setdefault(tuple(record), []).append({name: _value(value) for name, value in record.items()})
    tables = []
    for names, rows in kinds.items():
        same = [name for name in names if len(rows) > 1 and len({row[name] for row in rows}) == 1]
        shown = [name for name in names if name not in same]
        common = " · ".join(f"{_words(name)} {rows[0][name]}" for name in same)
        tables.append(Numbers(common, tuple(map(_words, shown)), tuple(tuple(row[n] for n in shown) for row in rows)))
    return tuple(tables)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _value(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_value(part) for part in value) or "none"
    if isinstance(value, dict):
        return " ".join(f"{_words(name)} {_value(part)}" for name, part in value.items())
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value) if missing(value) or isinstance(value, int | float) else str(value)


def _row(row: dict[str, Any]) -> str:
    """`lyon:dot:8 · alpha 50 · float32 · highlight: max abs 0.0353 (accuracy)`."""
    where = [
        f"{_words(name)} {_value(row[name])}" if isinstance(row[name], int | float) else str(row[name])
        for name in _WHERE
        if name in row and row[name] not in _UNSAID
    ]
    cell = [label(row)] if "approximation" in row else []
    return f"{' · '.join([*cell, *where])}: {_words(row['column'])} {number(row['value'])} ({row['table']})"


def _data(judged: list[Judgement]) -> pd.DataFrame:
    """One row per claim; conditions and evidence as JSON."""
    rows = [one.as_dict() for one in judged]
    lists = ("conditions", "evidence", "needs")
    return pd.DataFrame([row | {name: json.dumps(row[name]) for name in lists} for row in rows])
