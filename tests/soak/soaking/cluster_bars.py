"""Sweeps by one worker, by two, and by threads on the same cores, in turns: what the engine of a cluster costs.

Workers stand and have loaded their kernels, as threads have; connecting counts. The plan is a preset with few alphas.
"""

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from soaking.dask_processes import processes

from phongbench.accuracy import sweep
from phongbench.accuracy.sweep import Sweep
from phongbench.inputs.plan import preset
from phongbench.study.cluster.engine import Cluster
from phongbench.support.progress import Progress

#: what two workers have to gain on one, and what the engine may cost beside threads
LEAST_GAIN, MOST_COST = 1.85, 0.05
#: pairs of the pass that loads kernels
_FEW = 256


def measured(
    box: Path, preset_name: str, every: int, rounds: int, say: Callable[[str], None]
) -> tuple[dict[str, Any], list[str]]:
    """The seconds of each way, the two ratios, and which bar is missed."""
    whole = preset(preset_name)
    plan = replace(whole, alphas=whole.alphas[::every]).validated()
    prepared, few = sweep.prepare(plan), sweep.prepare(replace(plan, samples=_FEW))
    for each in (prepared, few):
        sweep.compile_kernels(each)
    with processes(box / "one", 1) as one, processes(box / "two", 2) as two:
        ways: dict[str, Callable[[Sweep], None]] = {
            "one worker": lambda wanted: _drained(_clustered(wanted, one.address, 1)),
            "two workers": lambda wanted: _drained(_clustered(wanted, two.address, 2)),
            "two threads": lambda wanted: _drained(sweep.run(wanted, jobs=2)),
        }
        for way in ways.values():
            way(few)
        seconds: dict[str, list[float]] = {name: [] for name in ways}
        for turn in range(rounds):
            for name in (list(ways) * 2)[turn % 3 : turn % 3 + 3]:
                began = time.perf_counter()
                ways[name](prepared)
                seconds[name].append(time.perf_counter() - began)
                say(f"round {turn + 1} of {rounds}, {name}: {seconds[name][-1]:.2f} s")
    gain = statistics.median(a / b for a, b in zip(seconds["one worker"], seconds["two workers"], strict=True))
    cost = statistics.median(a / b - 1 for a, b in zip(seconds["two workers"], seconds["two threads"], strict=True))
    faults = [f"two workers are {gain:.3f} times as fast as one, not {LEAST_GAIN}"] * (gain < LEAST_GAIN)
    faults += [f"the engine costs {cost:.1%} beside threads, more than {MOST_COST:.0%}"] * (cost > MOST_COST)
    told = {"evaluations": prepared.evaluations, "seconds": seconds, "gain of two workers": gain, "cost": cost}
    return told | {"faults": faults}, faults


def _clustered(wanted: Sweep, address: str, jobs: int) -> Iterable[Any]:
    return Cluster(address)(wanted, Progress(), jobs=jobs, done=())


def _drained(results: Iterable[Any]) -> None:
    for _ in results:
        pass
