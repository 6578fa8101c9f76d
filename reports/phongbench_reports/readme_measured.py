"""The generated parts of README.md that no run holds: our kernels beside peers, and the timing beside itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.alarms import ALLOWED, Alarms
from phongbench_reports.readme import table
from phongbench_reports.text import listed, number


def peers(found: Mapping[str, Any]) -> str:
    """Time of every peer over ours, for each kind of work and working set; who is absent is said to be."""
    kinds = list(dict.fromkeys((row["work"], row["working_set"]) for row in found["rows"]))
    tools = {row["by"]: f"{row['by']} {row['version']}" for row in found["rows"]}
    cells = {(row["by"], row["work"], row["working_set"]): _cell(row) for row in found["rows"]}
    lines = [(name, *(cells.get((by, *kind), "–") for kind in kinds)) for by, name in tools.items()]
    headings = ("", *(f"{work}, {place}" for work, place in kinds))
    shown = table(headings, lines, right=range(1, len(headings)))
    rounds = sorted({row["rounds"] for row in found["rows"]})
    absent = f" Absent: {listed(found['absent'])}." if found["absent"] else ""
    return (
        f"{shown}\n\n(float32 from six arrays of components, one thread, alpha {found['alpha']:g}, "
        f"gamma {found['gamma']}; ours in ns per element, the others as time / ours with its interval; "
        f"{rounds[0]} to {rounds[-1]} rounds.{absent})"
    )


def _cell(row: Mapping[str, Any]) -> str:
    if row["verdict"] == "baseline":
        return f"{number(row['ns'])} ns"
    return f"{number(row['ratio'])} ({number(row['ratio_low'])} to {number(row['ratio_high'])})"


def alarms(found: Sequence[Alarms]) -> str:
    """How often identical code was told apart, in each working set."""
    lines = [
        (a.working_set, str(a.repeats), str(a.rounds), str(a.resolved), f"{100 * a.share:.3g} %", number(a.spread))
        for a in found
    ]
    headings = ("working set", "repeats", "rounds", "told apart", "share", "98 % of ratios within 1 ±")
    shown = table(headings, lines, right=range(1, len(headings)))
    good = all(a.share <= ALLOWED for a in found)
    return f"{shown}\n\nAllowed is {100 * ALLOWED:.3g} %: {'kept' if good else 'not kept'}."
