"""What a person sees on a terminal: progress bars and tables. Talk goes to stderr, data to stdout.

NO_COLOR is honoured.
"""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from phongbench.support.progress import Progress


class TerminalProgress(Progress):
    """Progress bars with rate and time left on a terminal; single lines for each stage elsewhere."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.console = Console(stderr=True, quiet=quiet)
        self.bars = Bars(
            TextColumn("{task.description:<28}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[rate]}"),
            console=self.console,
            transient=True,
            disable=quiet or not self.console.is_terminal,
        )
        self.task: Any = None

    def __enter__(self) -> "TerminalProgress":
        self.bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bars.stop()

    def stage(self, text: str, total: float | None = None) -> None:
        """Begin a stage: a new bar, or a line where there is no terminal."""
        if self.task is not None:
            self.bars.remove_task(self.task)
        self.task = self.bars.add_task(text, total=total, rate="")
        if self.bars.disable:
            self.console.print(text, style="dim", highlight=False, markup=False)

    def advance(self, steps: float = 1) -> None:
        """Move the bar; large steps are evaluations, whose rate is shown."""
        if self.task is not None:
            speed = next((t.speed for t in self.bars.tasks if t.id == self.task), None)
            rate = f"{speed / 1e9:.2f} billion evaluations/s" if speed and speed > 1e6 else ""
            self.bars.update(self.task, advance=steps, rate=rate)

    def note(self, text: str) -> None:
        """Print a remark above the bar."""
        self.console.print(text, highlight=False, markup=False)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, right: Sequence[str] = ()) -> None:
    """Print a table on stdout; columns named in `right` are aligned right."""
    drawn = Table(title=title or None, box=SIMPLE, title_justify="left", pad_edge=False)
    for name in columns:
        drawn.add_column(name, justify="right" if name in right else "left", overflow="fold")
    for row in rows:
        drawn.add_row(*(cell if isinstance(cell, str) else text_of(cell) for cell in row))
    console = Console(markup=False)
    if not console.is_terminal:
        console = Console(markup=False, width=160)
    console.print(drawn)


def text_of(value: Any) -> str:
    """A number as people read it: four significant digits, nothing for what is missing."""
    if value is None or value != value:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def front_table(answer: Mapping[str, Any], *, everything: bool = False) -> None:
    """A front as a table, fastest first; what is off it is only counted, unless everything is requested."""
    points = answer["points"]
    shown = [p for p in points if everything or p["state"] != "off"]
    compiled, here = answer["cost_kind"] == "compiled", answer["target"] == "cpu"
    costs = [(p["cost"], p["bound_by"]) if compiled else (_interval(p), p["ns"]) for p in shown]
    rows = [
        (p["name"], p["error"], 255 * p["error"], p["ratio"], *cost, p["state"])
        for p, cost in zip(shown, costs, strict=True)
    ]
    title = f"{answer['stratum']} vectors, {answer['precision']}, {answer['space']} space, alpha {answer['alpha']}"
    kinds = ("cost / exact Phong", "cost", "bound by") if compiled else ("time / exact Phong", "99 % interval", "ns")
    columns = ("formula", answer["metric"], "8-bit codes", *kinds, "state")
    table(title, columns, rows, right=columns[1:6])
    notes = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    notes.print("errors were measured, and are lower bounds: nothing is promised of them; `recommend` proves bounds")
    if compiled:
        notes.print(f"errors: of run {answer['run']}; costs: beyond the dot product on {answer['target']}, compiled")
    else:
        times = f"working set {answer['working_set']}, of run {answer['run']}"
        notes.print(f"times: {times if here else 'as measured on ' + answer['target']}")
    for note in answer["notes"]:
        notes.print(f"note: {note}")
    if not answer["same_machine"] and here:
        notes.print("the run was timed on another kind of machine: its ratios hold there, its nanoseconds are left out")
    if len(answer["alphas"]) > 1:
        listed = ", ".join(f"{alpha:g}" for alpha in answer["alphas"])
        notes.print(f"error: the worst at alpha {listed}, the run's in that range")
    if answer["timed_precision"] != answer["precision"] and here:
        notes.print(f"{answer['precision']} is emulated and not timed: times are those of {answer['timed_precision']}")
    if len(shown) < len(points):
        notes.print(f"{len(points) - len(shown)} more are off the front: --all shows them")


def target_answers(answers: Sequence[Mapping[str, Any]]) -> None:
    """The cheapest formula within one 8-bit code at each exponent on each target."""
    rows = []
    for a in answers:
        codes, name = _codes(a["bound"]), a["name"] or "nothing fits"
        rows.append((f"{a['alpha']:g}", a["target"], name, codes, a["ratio"], _spread(a), a["bound_by"]))
    columns = ("alpha", "target", "formula", "8-bit codes", "/ exact Phong", "cost or 99 % interval", "bound by")
    table("Cheapest within one 8-bit code, float32, unit vectors", columns, rows, right=columns[3:6])


def recommendation(answer: Mapping[str, Any]) -> None:
    """The answer to a budget: a table of choices, then each one's reason, then what to bear in mind."""
    miss, choices = answer["nearest_miss"], answer["choices"]
    named = [*zip(("best", "next"), choices, strict=False), *([("nearest miss", miss)] if miss else [])]
    rows = [
        (role, c["name"], c["beta"], c["bound"], _codes(c["bound"]), c["coverage"], c["ratio"], _spread(c))
        for role, c in named
    ]
    target = answer.get("target", "cpu")
    where = "" if target == "cpu" else f", {target}"
    title = f"Largest error at most {answer['max_error']:.4g} at alpha {answer['alpha']}, {answer['precision']}{where}"
    counted = any(choice["cost_kind"] == "compiled" for _, choice in named)
    heads = ("cost / exact Phong", "cost") if counted else ("time / exact Phong", "99 % interval")
    columns = ("", "formula", "beta", "at most", "8-bit codes", "coverage", *heads)
    table(title, columns, rows, right=columns[2:5] + columns[6:])
    console = Console(markup=False, highlight=False)
    if not choices:
        console.print("nothing meets the budget")
    for role, choice in named:
        console.print(f"{role}: {choice['why']}", soft_wrap=True)
    if answer.get("steps"):
        _steps(answer, console)
    for note in answer["notes"]:
        console.print(f"note: {note}", soft_wrap=True)
    for line in _elsewhere(answer.get("elsewhere", ())):
        console.print(line, soft_wrap=True)
    # a range of exponents is no one function, and shaders compute in float32
    if choices and answer["precision"] == "float32" and not re.search(r",|\.\.", answer["alpha"]):
        console.print(f"as code: phongbench shader {choices[0]['name']} --alpha {answer['alpha']}", soft_wrap=True)
    console.print(f"from {answer['run']}" if answer["run"] else "from the laws, without a run")


def _elsewhere(others: Iterable[Mapping[str, Any]]) -> list[str]:
    """A line for each other answer, with all the targets that give it."""
    lines: dict[str, list[str]] = {}
    for other in others:
        cost = f"{other['cost']:.3g} {other['unit']} beyond the dot product, {other['ratio']:.3g} of exact Phong's"
        line = f"{other['name']}, {cost}; error {other['max_abs']:.3g}"
        lines.setdefault(line, []).append(other["target"])
    return [f"on {', '.join(targets)}: {line}" for line, targets in lines.items()]


def _steps(answer: Mapping[str, Any], console: Console) -> None:
    """What each step of a highlight from raw vectors costs, and the recipe that normalises everything."""
    if usual := answer["usual"]:
        cost = f"{usual['ratio']:.3g} of exact Phong's time"
        console.print(f"to compare: {usual['name']}, which normalises everything, takes {cost}", soft_wrap=True)
    rows = [
        (s["step"], s["what"], s["ns"], s["share"], f"{s['share_low']:.2g} .. {s['share_high']:.2g}")
        for s in answer["steps"]
    ]
    columns = ("step", "", "ns", "share of exact Phong", "99 % interval")
    table(f"What each step costs, {answer['working_set']}", columns, rows, right=columns[2:])


def claims_table(answer: Mapping[str, Any]) -> None:
    """The textbook claims with their verdicts, each with its reason below, or what would measure it."""
    from phongbench.analysis.claims import SIGNS

    console = Console(markup=False, highlight=False)
    if not console.is_terminal:
        console = Console(markup=False, highlight=False, width=160)
    drawn = Table(box=SIMPLE, pad_edge=False, show_lines=False)
    drawn.add_column("")
    drawn.add_column("verdict", no_wrap=True)
    drawn.add_column("claim, and why")
    for claim in answer["claims"]:
        lacking = claim["lacking"] or ""
        fix = f"\n{lacking[:1].upper()}{lacking[1:]}" if lacking else ""
        text = Text.assemble((claim["claim"], "bold"), f"\n{claim['because']}{fix}\n")
        drawn.add_row(claim["key"], f"{SIGNS[claim['verdict']]} {claim['verdict']}", text)
    console.print(drawn)
    counted = Counter(claim["verdict"] for claim in answer["claims"])
    summary = ", ".join(f"{counted[verdict]} {verdict}" for verdict in SIGNS if counted[verdict])
    notes = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    notes.print(f"of run {answer['run']}: {summary}; --json has the rules, all conditions and the rows that decide")


def bench_tables(answer: Mapping[str, Any]) -> None:
    """The comparison with peers, one table for each kind of work, then who is absent, then the sweep."""
    columns = ("by", "version", "ns", "time / ours", "99 % interval", "cores", "largest error", "verdict")
    for work in dict.fromkeys((r["work"], r["working_set"], r["elements"]) for r in answer["rows"]):
        mine = [r for r in answer["rows"] if (r["work"], r["working_set"], r["elements"]) == work]
        rows = [
            (r["by"], r["version"], r["ns"], r["ratio"], _interval(r), r["cores"], r["error"], r["verdict"])
            for r in mine
        ]
        title = f"{work[0]}, float32, {work[2]:,} elements ({work[1]}), ns per element"
        table(title, columns, rows, right=columns[2:7])
    console = Console(markup=False, highlight=False)
    for name, why in answer["absent"].items():
        console.print(f"{name} is absent: {why}", soft_wrap=True)
    for note in answer["notes"]:
        console.print(f"note: {note}", soft_wrap=True)
    heads = ("pairs", "subnormal", "bare chain", "ours", "chain / ours", "99 % interval")
    slow = [
        (r["pairs"], f"{r['subnormal']:.1%}", r["chain_ns"], r["ours_ns"], r["ratio"], _interval(r))
        for r in answer.get("subnormals", ())
    ]
    if slow:
        table("What subnormal numbers cost: lyon, gamma 64, float32, in l1, ns per element", heads, slow)
    sweep = answer["sweep"]
    console.print(
        f"accuracy sweep: {sweep['evaluations_per_second'] / 1e9:.2f} billion evaluations a second and core, "
        f"{sweep['ratio']:.0f} times plain NumPy over the same cells",
        soft_wrap=True,
    )


def _spread(choice: Mapping[str, Any]) -> str:
    """A time's interval, or the cost that a compiler counted."""
    if choice.get("cost_kind") == "compiled":
        return f"{choice['cost']:.3g} {choice['unit']}"
    return _interval(choice)


def _codes(bound: float | None) -> float | None:
    return None if bound is None else 255 * bound


def _interval(row: Mapping[str, Any]) -> str:
    low, high = row["ratio_low"], row["ratio_high"]
    return "" if low is None or high is None else f"{low:.3g} .. {high:.3g}"
