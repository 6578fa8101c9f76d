"""What a run says to ship, as `run` and `show` tell it: a line for each group of exponents, and what to do next."""

from collections.abc import Mapping
from typing import Any

from phongbench.cli.answer_tables import LEVEL, interval
from phongbench.cli.layout import command, say, table


def verdict_table(verdict: Mapping[str, Any]) -> None:
    """The verdict of `analysis.verdict`."""
    groups, timed, withheld = verdict["groups"], verdict["timed"], verdict["withheld"]
    rows = []
    for group in groups:
        codes = None if group["bound"] is None else 255 * group["bound"]
        times = () if not timed else ("withheld", "") if withheld else (group["ratio"], interval(group))
        tied = (group["tied"],) if timed else ()
        rows.append((_alphas(group["alphas"]), _ship(group, withheld=withheld), codes, *times, *tied))
    heads = ("time / exact Phong", LEVEL, "tied with") if timed else ()
    errors = "at most, 8-bit codes" if timed else "sampled, 8-bit codes"
    columns = ("alpha", "formula", errors, *heads)
    table(_title(verdict), columns, rows, right=(errors, *heads[:2]))
    for note in _notes(verdict):
        say(note)


def next_commands(verdict: Mapping[str, Any], run: str) -> list[str]:
    """Print the commands that a reader of the verdict goes on with; the words of a `recommend` among them.

    run  the run's name for commands: `latest`, an id or a folder
    """
    named = [group for group in verdict["groups"] if group["name"]]
    if not named:
        return []
    middle = named[len(named) // 2]
    alpha = f"{middle['alphas'][len(middle['alphas']) // 2]:.10g}"
    precision = "" if verdict["precision"] == "float32" else f" --precision {verdict['precision']}"
    whose = "" if run == "latest" else f" --run {run}"
    words = f"--alpha {alpha} --max-error 1/255{precision}"
    if verdict["timed"]:
        command(f"phongbench recommend {words}{whose}", "next    ")
    shorter = precision if verdict["precision"] == "float16" else ""
    command(f"phongbench shader {middle['name']} --alpha {alpha}{shorter}", "code    ")
    return words.split() if verdict["timed"] else []


def _title(verdict: Mapping[str, Any]) -> str:
    precision = verdict["precision"]
    if not verdict["timed"]:
        return f"Least sampled error, {precision}, unit vectors; nothing was timed, so nothing is cheapest"
    times = "" if verdict["timed_precision"] == precision else f" by the times of {verdict['timed_precision']}"
    return f"What to ship: the cheapest within one 8-bit code, {precision}{times}, unit vectors"


def _alphas(alphas: list[float]) -> str:
    ends = f"{alphas[0]:g}", f"{alphas[-1]:g}"
    return ends[0] if len(alphas) == 1 else " .. ".join(ends)


def _ship(group: Mapping[str, Any], *, withheld: bool) -> str:
    """The formula's name, or why it is not the one to ship."""
    if group["name"] is None:
        return "nothing fits"
    if group["exact"] and not withheld and group["name"] != "phong":
        return f"phong (no measurable gain by {group['name']})"
    return str(group["name"])


def _notes(verdict: Mapping[str, Any]) -> list[str]:
    notes = []
    if verdict["withheld"]:
        notes.append("identical code differed in time, so no claim to be faster is made: time it again when quiet")
    if verdict["timed"] and verdict["timed_precision"] != verdict["precision"]:
        notes.append(f"{verdict['precision']} is emulated here: the same kernels were timed in float32")
    if any(group["tied"] for group in verdict["groups"]) and not verdict["withheld"]:
        notes.append("tied: each time lies within the other's interval; the formula that errs less is named")
    return notes
