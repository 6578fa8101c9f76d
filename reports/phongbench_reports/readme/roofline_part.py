"""The generated part of our loops, of shading and of pictures beside the least that they can take here."""

from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.benchmarks import call_bench, kernel_bench
from phongbench.benchmarks.bounds import ROOM
from phongbench.benchmarks.ledger import ceilings
from phongbench.support.progress import Progress
from phongbench_reports.readme.markdown import table
from phongbench_reports.text import number

#: seconds for the rounds of our loops; and whom they are interleaved with, since bounds need no peer
SECONDS, BESIDE = 10.0, ("numpy",)


def measured() -> dict[str, Any]:
    """The document of `phongbench bench`, as far as it concerns bounds."""
    answer = kernel_bench.bench(BESIDE, budget_seconds=SECONDS, sweep=dict)
    answer["calls"], told = call_bench.measure(answer["ceilings"], progress=Progress())
    return {**answer, "notes": [*answer["notes"], *told]}


def rooflines(answer: Mapping[str, Any]) -> str:
    """What one core gives, our loops and calls over it, and why some take longer."""
    if not answer["bounds"]:
        return "Bounds are counted in x86's code of vectors, which this machine does not run."
    gives = [(place, *map(number, rates)) for place, *rates in ceilings(answer)]
    heads = (
        "one core, in a nanosecond",
        "float32 multiply-adds",
        "vector operations",
        "roots with a quotient",
        "bytes",
    )
    parts = [table(heads, gives, right=(1, 2, 3, 4)), _loops(answer["bounds"]), _calls(answer["calls"])]
    why = "\n".join(f"- {note}." for note in answer["notes"] if "bound" in note or "roofline" in note)
    reasons = f"What takes more than {ROOM} times its bound:\n\n{why}" if why else f"None takes {ROOM} times its bound."
    return "\n\n".join([*parts, reasons])


def _loops(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = [
        (
            row["work"],
            row["working_set"],
            f"{number(row['ns'])} ns",
            f"{number(row['bound'])} ns",
            number(row["over_bound"]),
            row["bound_by"],
        )
        for row in rows
    ]
    return table(("loop", "in", "an element", "bound", "time / bound", "bound by"), lines, right=(2, 3, 4))


def _calls(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = [
        (
            row["name"],
            row["place"],
            f"{1e3 * row['seconds']:.1f} ms",
            f"{1e3 * row['bound']:.2f} ms",
            number(row["over_bound"]),
            row["bound_by"],
        )
        for row in rows
    ]
    return table(("call, one thread", "of", "time", "roofline", "time / roofline", "bound by"), lines, right=(2, 3, 4))
