"""The quick study as its user has it: a command in a process of its own, what each stage takes, and its memory."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.benchmarks.call_bench import YARDSTICK, yardstick
from phongbench.errors import MeasurementError
from phongbench.support.progress import Progress
from phongbench.timing import statistics
from phongbench.timing.interleaved import interleaved
from phongbench.timing.statistics import MIN_ROUNDS

#: stages of a study whose time is told; the timing's is a budget that is given
STAGES = ("compiling", "accuracy", "stability", "report", "total")
COMMAND = "the whole command"


@dataclass(frozen=True)
class Wall:
    """What the study took as a command, from start to exit of its process.

    name      str                cold or warm
    document  what `phongbench run --json` printed
    seconds   float              wall time of the process
    """

    name: str
    document: Mapping[str, Any]
    seconds: float


def study_as_command(name: str, folder: Path, cache: Path | None, extra: Sequence[str] = ()) -> Wall:
    """Run the quick study in a process of its own, with its kernels cached in `cache`, or where they always are."""
    command = [sys.executable, "-m", "phongbench", "run", "--preset", "quick", "--out", str(folder), "--json", *extra]
    environment = {**os.environ, **({} if cache is None else {"PHONGBENCH_CACHE": str(cache)})}
    started = time.perf_counter()
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, cwd=folder.parent, env=environment)
    seconds = time.perf_counter() - started
    if done.returncode:
        raise MeasurementError(
            f"the {name} study ended with exit code {done.returncode}", "phongbench run", "see above"
        )
    return Wall(name, json.loads(done.stdout), seconds)


def stages(count: int, progress: Progress, extra: Sequence[str] = ("--no-timing",)) -> list[dict[str, Any]]:
    """What the stages of so many warm quick studies take, in turn with the yardstick; one before them warms up.

    rows  part, "stage"; name, place, rounds; seconds, the least; the ratio over the yardstick, whose interval has ends
          from 8 studies on; peak_mib, of the whole command
    """
    walls: list[Wall] = []
    progress.stage("quick studies", 2 * (count + 1))
    with tempfile.TemporaryDirectory(prefix="phongbench-bench-") as folder:

        def study() -> float:
            walls.append(study_as_command("warm", Path(folder) / str(len(walls)), None, extra))
            return walls[-1].seconds

        timed = {COMMAND: study, YARDSTICK: yardstick()}
        times = interleaved(timed, rounds=count, warm=1, step=progress.advance)
    measured = walls[-count:]
    yard = times.readings.used[:, times.names.index(YARDSTICK)] / 1e9
    took = {name: [wall.document["seconds"][name] for wall in measured] for name in STAGES}
    took[COMMAND] = [wall.seconds for wall in measured]
    peak = max(wall.document["peak_mib"] or 0.0 for wall in measured)
    return [_row(name, np.array(seconds), yard, peak) for name, seconds in took.items() if min(seconds) > 0]


def _row(name: str, seconds: statistics.Floats, yard: statistics.Floats, peak: float) -> dict[str, Any]:
    return {
        "part": "stage",
        "name": name,
        "place": "quick, warm",
        "rounds": len(seconds),
        "seconds": float(seconds.min()),
        **statistics.ratio(seconds, yard).columns(),
        "peak_mib": peak if name == COMMAND and peak else None,
    }


def note(count: int) -> str | None:
    """That so few studies give no interval; None where they do."""
    if count >= MIN_ROUNDS:
        return None
    return f"stages were measured {count} times: --studies {MIN_ROUNDS} gives them intervals"
