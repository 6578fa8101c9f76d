"""What came of tries, as tables of the guide."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from soaking.cluster_kills import Kills
from soaking.disk_tries import Tries
from soaking.faulty_disk import CALLS

from phongbench_reports.readme.markdown import table

_ENDS = ("done", "refused", "killed")


def of_tries(found: Mapping[str, Tries]) -> str:
    """A line for each command: its calls to the disk, where they were counted, and how its tries ended."""
    counted = any(tries.calls for tries in found.values())
    calls = [f"`{name}`" for name in CALLS] if counted else []
    headings = [
        "command",
        *calls,
        *(["calls"] if counted else []),
        "tries",
        *_ENDS,
        "folders left",
        "not whole, or other rows",
    ]
    lines = []
    for name, tries in found.items():
        each = [tries.calls.get(one, 0) for one in CALLS] if counted else []
        ends = [sum(n for end, n in tries.ends.items() if end.endswith(f": {word}")) for word in _ENDS]
        numbers = [
            *each,
            *([sum(each)] if counted else []),
            tries.ends.total(),
            *ends,
            len(tries.states),
            len(tries.faults),
        ]
        lines.append([f"`{name}`", *(f"{number:,}" for number in numbers)])
    return table(headings, lines, right=range(1, len(headings)))


def of_service(seen: Mapping[str, Any]) -> str:
    """How requests fared, what was answered, what the processes held, and how the service ended."""
    lines = [(words, f"{seen['clients'].get(name, 0):,}") for name, words in _CLIENTS.items()]
    lines += [(f"answers {status}", f"{n:,}") for status, n in seen["statuses"].items()]
    lines += [
        (f"MiB of {name}, early and at the end", f"{m[1]:.0f}, {m[-1]:.0f}") for name, m in _named(seen["memory"])
    ]
    lines += [
        ("files that the workers hold, before the first client and after the last", ", ".join(map(str, seen["files"]))),
        ("seconds until a killed worker had a successor that was ready", ", ".join(map(str, seen["replaced"]))),
        ("exit code after SIGTERM; processes that outlive it", f"{seen['exit_code']}; {seen['left']}"),
        ("faults", f"{seen['fault_count']:,}"),
    ]
    return table([f"{seen['requests']:,} requests", ""], lines, right=[1])


def _named(memory: Sequence[Sequence[float]]) -> Iterator[tuple[str, Sequence[float]]]:
    """The processes that lived long enough to be judged: the first one watches, the last one succeeded a killed one."""
    names = ("the process that watches", *["a worker"] * (len(memory) - 2), "the successor of a killed one")
    return ((name, seen) for name, seen in zip(names, memory, strict=True) if len(seen) > 2)


_CLIENTS = {
    "answered": "answered",
    "vanished": "whose client vanished",
    "stalled": "whose client stalled in the middle, and left",
    "gave up": "whose client gave up waiting for a request's end",
    "cut off": "whose worker was killed",
}


def of_kills(found: Mapping[str, Kills]) -> str:
    """A line for each victim: its kills, how the runs ended that were hit, and what was wrong afterwards."""
    headings = ["killed", "kills", "in the sweep", "ended all the same", "went on with `--resume`", "other rows"]
    lines = []
    for victim, kills in found.items():
        count, done = kills.ends.total(), kills.ends["done"]
        numbers = [count, kills.sweeping, done, count - done, len(kills.faults)]
        lines.append([victim, *(f"{number:,}" for number in numbers)])
    return table(headings, lines, right=range(1, len(headings)))
