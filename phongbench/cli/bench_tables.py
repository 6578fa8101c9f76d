"""What `phongbench bench` and the comparison of its ledgers print."""

from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.cli.answer_tables import LEVEL, interval
from phongbench.cli.layout import say, table


def bench_tables(answer: Mapping[str, Any]) -> None:
    """The comparison with peers, one table for each kind of work; then what the machine gives, and our loops and calls
    beside what they can take at least; then who is absent, notes, subnormals and the sweep.
    """
    columns = ("by", "version", "ns", "time / ours", LEVEL, "cores", "largest error", "verdict")
    for work in dict.fromkeys((r["work"], r["working_set"], r["elements"]) for r in answer["rows"]):
        mine = [r for r in answer["rows"] if (r["work"], r["working_set"], r["elements"]) == work]
        rows = [
            (r["by"], r["version"], r["ns"], r["ratio"], interval(r), r["cores"], r["error"], r["verdict"])
            for r in mine
        ]
        title = f"{work[0]}, float32, {work[2]:,} elements ({work[1]}), ns per element"
        table(title, columns, rows, right=columns[2:7])
    _ceilings(answer)
    for working_set in dict.fromkeys(r["working_set"] for r in answer["bounds"]):
        _bounds(working_set, [r for r in answer["bounds"] if r["working_set"] == working_set])
    _calls(answer["calls"])
    _stages(answer["stages"])
    for name, why in answer["absent"].items():
        say(f"{name} is absent: {why}")
    for note in answer["notes"]:
        say(f"note: {note}")
    _subnormals(answer["subnormals"])
    sweep = answer["sweep"]
    spread = f" ({interval(sweep)})" if interval(sweep) else ""
    say(
        f"accuracy sweep: {sweep['evaluations_per_second'] / 1e9:.2f} billion evaluations a second and core, "
        f"{sweep['ratio']:.0f} times plain NumPy{spread} over the same cells"
    )


def _ceilings(answer: Mapping[str, Any]) -> None:
    """What one core gives at best in each working set."""
    from phongbench.benchmarks.ledger import ceilings

    heads = ("in", "multiply-adds", "vector operations", "roots", "bytes")
    if rows := ceilings(answer):
        table("What one core does in a nanosecond, float32", heads, rows, right=heads[1:])


def _bounds(working_set: str, bounds: Sequence[Mapping[str, Any]]) -> None:
    """Our loops beside the least time that their code can take."""
    heads = ("work", "ns", "bound", "ns / bound", "bound by", "multiply-adds", "vector operations", "bytes")
    rows = [
        (r["work"], r["ns"], r["bound"], r["over_bound"], r["bound_by"], r["multiply_adds"], r["vectors"], r["bytes"])
        for r in bounds
    ]
    table(
        f"Our loops and their bounds, float32, {working_set}, for an element", heads, rows, right=heads[1:4] + heads[5:]
    )


def _calls(calls: Sequence[Mapping[str, Any]]) -> None:
    """Shading and pictures beside their rooflines."""
    heads = ("call", "of", "ms", "roofline", "ms / roofline", "bound by", "million multiply-adds", "roots", "MB")
    rows = [
        (
            r["name"],
            r["place"],
            1e3 * r["seconds"],
            r["bound"] and 1e3 * r["bound"],
            r["over_bound"],
            r["bound_by"],
            r["multiply_adds"] / 1e6,
            r["roots"] / 1e6,
            r["bytes"] / 1e6,
        )
        for r in calls
    ]
    if rows:
        table("Shading and pictures and their rooflines, one thread", heads, rows, right=heads[2:5] + heads[6:])


def _stages(stages: Sequence[Mapping[str, Any]]) -> None:
    """What a study takes, stage by stage."""
    heads = ("stage", "seconds", "/ yardstick", LEVEL, "studies", "peak MiB")
    rows = [(r["name"], r["seconds"], r["ratio"], interval(r), r["rounds"], r["peak_mib"]) for r in stages]
    if rows:
        table("The quick study without its timing, warm", heads, rows, right=heads[1:])


def _subnormals(found: Sequence[Mapping[str, Any]]) -> None:
    heads = ("pairs", "subnormal", "bare chain", "ours", "chain / ours", LEVEL)
    rows = [(r["pairs"], f"{r['subnormal']:.1%}", r["chain_ns"], r["ours_ns"], r["ratio"], interval(r)) for r in found]
    if rows:
        table("What subnormal numbers cost: lyon, gamma 64, float32, in l1, ns per element", heads, rows)


def ledger_tables(answer: Mapping[str, Any]) -> None:
    """What moved between two ledgers."""
    level = f"{100 * answer['level']:g} %"
    moved = [row for row in answer["rows"] if row["verdict"] != "unresolved"]
    heads = ("what", "where", "over", "before", "after", "after / before", f"{level} interval", "verdict")
    rows = [
        (r["name"], r["place"], r["over"], r["before"], r["after"], r["ratio"], interval(r), r["verdict"])
        for r in moved
    ]
    if rows:
        table(f"What moved, {answer['machine']}: times over a yardstick's", heads, rows, right=heads[3:7])
    single = sum(not interval(row) for row in answer["rows"])
    once = f"; {single} were measured too few times to tell" if single else ""
    say(
        f"{len(moved)} of {len(answer['rows'])} times moved by 2 % or more and beyond their {level} intervals; up to "
        f"{(1 - answer['level']) * (len(answer['rows']) - single):.0f} may by chance{once}"
    )
    for side in ("a", "b"):
        if only := answer[f"only_{side}"]:
            say(f"only {side.upper()} has {', '.join(' '.join((e['name'], e['place'])) for e in only)}")
