"""The generated parts that no run holds: our kernels beside peers, and the timing beside itself."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from phongbench.benchmarks import scene_bench
from phongbench.benchmarks.false_alarms import ALLOWED, Alarms
from phongbench.benchmarks.study_bench import Wall
from phongbench_reports.readme.markdown import table
from phongbench_reports.readme.measurements import RACE, SCENES, SIZE, Goal
from phongbench_reports.text import INTERVAL, listed, number, ratio


def peers(compared: Mapping[str, Any]) -> str:
    """Time of every peer over ours, for each kind of work and working set; who is absent is said to be."""
    kinds = list(dict.fromkeys((row["work"], row["working_set"]) for row in compared["rows"]))
    tools = {row["by"]: f"{row['by']} {row['version']}" for row in compared["rows"]}
    cells = {(row["by"], row["work"], row["working_set"]): _cell(row) for row in compared["rows"]}
    lines = [(name, *(cells.get((by, *kind), "–") for kind in kinds)) for by, name in tools.items()]
    headings = ("", *(f"{work}, {place}" for work, place in kinds))
    shown = table(headings, lines, right=range(1, len(headings)))
    rounds = sorted({row["rounds"] for row in compared["rows"]})
    absent = f" Absent: {listed(compared['absent'])}." if compared["absent"] else ""
    return (
        f"{shown}\n\n(float32 from six arrays of components, one thread, alpha {compared['alpha']:g}, "
        f"gamma {compared['gamma']}; ours in ns per element, the others as time / ours with its {INTERVAL}; "
        f"{rounds[0]} to {rounds[-1]} rounds.{absent})"
    )


def _cell(row: Mapping[str, Any]) -> str:
    return f"{number(row['ns'])} ns" if row["verdict"] == "baseline" else ratio(row)


def alarms(counts: Sequence[Alarms]) -> str:
    """How often identical code seemed to differ, in each working set."""
    lines = [
        (a.working_set, str(a.repeats), str(a.rounds), str(a.resolved), f"{100 * a.share:.3g} %", number(a.spread))
        for a in counts
    ]
    headings = ("working set", "repeats", "rounds", "resolved", "share", "98 % of ratios within 1 ±")
    shown = table(headings, lines, right=range(1, len(headings)))
    good = all(a.share <= ALLOWED for a in counts)
    return f"{shown}\n\nAllowed is {100 * ALLOWED:.3g} %: {'met' if good else 'not met'}."


def throughput(rates: Mapping[str, float]) -> str:
    """Evaluations a second of the sweep beside plain NumPy's."""
    plain, ours = rates["numpy_evaluations_per_second"], rates["evaluations_per_second"]
    lines = [
        ("plain NumPy", f"{number(round(plain / 1e6, 1))} million", "1"),
        ("phongbench", f"{number(round(ours / 1e6))} million", f"{number(rates['ratio'])}"),
    ]
    return table(("sweep", "evaluations per second and core", "/ NumPy"), lines, right=(1, 2))


def times(walls: Sequence[Wall]) -> str:
    """The wall times of the study as a command."""
    size = walls[0].document
    stages = ("accuracy", "timing", "report")
    lines = [
        (wall.name, *(f"{wall.document['seconds'][stage]:.1f} s" for stage in stages), f"{wall.seconds:.1f} s")
        for wall in walls
    ]
    command = (
        f"The quick study, {number(size['cells'])} cells and {number(round(size['evaluations'] / 1e9, 1))} billion "
        "evaluations, as a command: cold with no kernel compiled yet, warm the same command again."
    )
    seconds = table(("kernel cache", *stages, "the whole command"), lines, right=range(1, len(stages) + 2))
    return f"{command}\n\n{seconds}"


def goals(made: Sequence[Goal], cores: int) -> str:
    """How long the Makefile's goals took on a bare clone, and what they told of it."""
    told = [f"`make {goal.name}` took {_duration(goal.seconds)}{_within(goal)}" for goal in made]
    return f"On a bare clone, {cores} cores, packages fetched before, no kernel compiled: {'; '.join(told)}."


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} minutes"


def _within(goal: Goal) -> str:
    """Where the time of a run went, and how many tests passed."""
    run, test = r"; where [\d.]+ s went: (.+)", r"(\d+ passed.*) in [\d.]+ ?s"
    spent = re.search(run, goal.output) or re.search(test, goal.output)
    return f" ({spent[1].strip()})" if spent else ""


def scenes(measured: Mapping[str, Any]) -> str:
    """The results of `measured_scenes`: a table of skips, and one of tracers with what is compared."""
    lines = []
    for name, rows in measured["skips"].items():
        full, exact, none = ({row["variant"]: row for row in rows}[v] for v in ("all", "exact", "none"))
        lines.append(
            (
                name,
                str(SCENES[name]),
                f"{1e3 * full['seconds']:.0f} ms",
                f"{none['ratio']:.2f} ×",
                f"{none['ratio'] / exact['ratio']:.2f} ×",
                "yes" if exact["same_bits"] else "no",
                number(full["largest_change"]),
            )
        )
    headings = ("scene", "depth", "time", "all skips", "exact ones alone", "which change no bit", "all change at most")
    return (
        f"{table(headings, lines, right=(1, 2, 3, 4, 6))}\n\n({SIZE[0]} × {SIZE[1]} pixels, exact Phong, every core; "
        "gains over nothing left out, from interleaved rounds; changes in linear light, where white is 1.)\n\n"
        f"{_tracers(measured['tracers'], measured['absent'])}"
    )


def _tracers(rows: Sequence[Mapping[str, Any]], absent: Sequence[Mapping[str, str]]) -> str:
    """Who drew the same scene in which time, how alike the pictures are, and what is compared."""
    lines = [
        (
            row["tracer"],
            row["draws"],
            f"{1e3 * row['seconds']:.0f} ms",
            number(row["mpixels_per_second"]),
            number(row["mrays_per_second"]),
            number(row["ratio"]),
            "–" if row["tracer"] == scene_bench.OURS else _share(row["pixels_off"]),
            _share(row["surfaces_agree"]),
        )
        for row in rows
    ]
    headings = (
        "tracer", "draws", "time", "million pixels / s", "million rays / s", "time / ours drawing the same",
        "pixels off by a code", "pixels as far away",
    )  # fmt: skip
    notes = {row["tracer"]: f"- {row['tracer']} {row['version']}: {row['note']}." for row in rows}
    notes |= {row["tracer"]: f"- {row['tracer']} is absent: {row['why']}." for row in absent}
    return (
        f"{RACE} at {rows[0]['size']}, drawn by others in the same run, in interleaved rounds:\n\n"
        f"{table(headings, lines, right=range(2, len(headings)))}\n\n"
        "(Least time; a ratio is the median over the rounds. Rays count mirrored ones, not those for shadows. Pixels "
        "off are those that differ from ours by more than 1/255; pixels as far away show something at the distance "
        f"that a plain float64 tracer finds, to 1 %, or nothing as it does.)\n\n" + "\n".join(notes.values())
    )


def _share(value: float | None) -> str:
    """A share in percent that does not round to all or nothing."""
    if value is None:
        return "–"
    return f"{100 * value:.2g} %" if value < 0.5 else f"{100 * value:.4f} %".replace("100.0000", "100")
