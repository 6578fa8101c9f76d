"""A disk that fails at any call, and kills at any moment, leave nothing half-written and nothing that cannot go on."""

import json
import shutil
import sys
from typing import Any

import pytest
from soaking import faulty_disk
from soaking.disk_tries import Tries
from soaking.tables import of_tries

#: faults that are tried here; `python -m soaking disk` tries each at every call
SOME = 40
COMMANDS = ("run", "run --resume", "merge", "report", "render")

needs_preloading = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="preloads a library that cc builds"
)


def told(words: list[str]) -> dict[str, Any]:
    """What the program prints; it fails where a fault was found."""
    found = faulty_disk.preloaded(words)
    document: dict[str, Any] = json.loads(found.stdout)
    assert [fault for command in document.values() for fault in command["faults"]] == []
    assert found.returncode == 0
    return document


@needs_preloading
def test_a_sample_of_every_fault_leaves_all_whole() -> None:
    found = told(["disk", "--count", str(SOME)])
    assert tuple(found) == COMMANDS
    assert sum(command["tries"] for command in found.values()) == SOME
    # every kind of call is reached, or the library is not in between
    assert all(sum(command["calls"][name] for command in found.values()) > 0 for name in faulty_disk.CALLS)
    ends = {end for command in found.values() for end in command["ends"]}
    assert {"kill -9: killed"} < ends
    assert any(end.endswith(": refused") for end in ends)
    assert not {end for end in ends if "exit" in end}


def test_the_table_counts_calls_and_ends() -> None:
    tries = Tries({"open": 2, "write": 1200, "fsync": 0, "rename": 1, "mkdir": 0}, states={"a", "b"}, faults=["x"])
    tries.ends.update({"EIO: refused": 2, "EINTR: done": 1, "kill -9: killed": 3})
    *_, line = of_tries({"run": tries}).splitlines()
    assert line == "| `run` | 2 | 1,200 | 0 | 1 | 0 | 1,203 | 6 | 1 | 2 | 3 | 2 | 1 |"
    killed = Tries()
    killed.ends["random kill: killed"] = 4
    assert of_tries({"report": killed}).splitlines()[-1] == "| `report` | 4 | 0 | 0 | 4 | 0 | 0 |"
