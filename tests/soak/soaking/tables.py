"""What came of tries, as tables of the guide."""

from collections.abc import Mapping

from soaking.cluster_kills import Kills
from soaking.disk_tries import Tries
from soaking.faulty_disk import CALLS

from phongbench_reports.readme.markdown import table

_ENDS = ("done", "refused", "killed")


def of_tries(found: Mapping[str, Tries]) -> str:
    """A line for each command: its calls to the disk, where they were counted, and how its tries ended."""
    counted = any(tries.calls for tries in found.values())
    calls = [f"`{name}`" for name in CALLS] if counted else []
    headings = ["command", *calls, *(["calls"] if counted else []), "tries", *_ENDS, "not whole, or other rows"]
    lines = []
    for name, tries in found.items():
        each = [tries.calls.get(one, 0) for one in CALLS] if counted else []
        ends = [sum(n for end, n in tries.ends.items() if end.endswith(f": {word}")) for word in _ENDS]
        numbers = [*each, *([sum(each)] if counted else []), tries.ends.total(), *ends, len(tries.faults)]
        lines.append([f"`{name}`", *(f"{number:,}" for number in numbers)])
    return table(headings, lines, right=range(1, len(headings)))


def of_kills(found: Mapping[str, Kills]) -> str:
    """A line for each victim: its kills, how the runs ended that were hit, and what was wrong afterwards."""
    headings = ["killed", "kills", "in the sweep", "ended all the same", "went on with `--resume`", "other rows"]
    lines = []
    for victim, kills in found.items():
        count, done = kills.ends.total(), kills.ends["done"]
        numbers = [count, kills.sweeping, done, count - done, len(kills.faults)]
        lines.append([victim, *(f"{number:,}" for number in numbers)])
    return table(headings, lines, right=range(1, len(headings)))
