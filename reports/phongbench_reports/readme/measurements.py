"""What the pages tell beside a run: measured here, on this machine, while nothing else runs."""

import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from phongbench.benchmarks import scene_bench, skip_gains
from phongbench.errors import InputError, MeasurementError
from phongbench.results import runs
from phongbench.scenes.scene_files import read_scene
from phongbench.support.progress import Progress

#: seconds for the rounds with the peers, and how often the twin is measured
PEER_SECONDS, REPEATS = 20.0, 200
#: scenes whose skips are measured, with the depth of reflections; and what the plain tracer is compared on
SCENES = {"many-lights": 2, "chequerboard": 5, "copper-and-glass": 0, "tessellation": 1, "test-card": 1, "torus": 1}
RACE, DEPTH, SIZE = "chequerboard", 3, (1280, 720)
#: what `make` and this checkout tell their children, and a clone must not hear
_INHERITED = ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "PHONGBENCH_STARTED", "PYTHONPATH", "VIRTUAL_ENV")


@dataclass(frozen=True)
class Goal:
    """A goal of the Makefile, made in a bare clone.

    name     str    run or test
    seconds  float  wall time, from `make` to its end
    output   str    what it printed
    """

    name: str
    seconds: float
    output: str


def goal_in_clone(name: str, root: Path, folder: Path) -> Goal:
    """Clone what is committed of a checkout into a new folder, and make a goal there, with no kernel compiled before.

    Raises MeasurementError where git, or the goal, fails.
    """
    clone, kernels = folder / name, folder / f"{name}-kernels"
    folder.mkdir(exist_ok=True)
    environment = {key: value for key, value in os.environ.items() if key not in _INHERITED}
    _ended_well(["git", "clone", "--quiet", str(root), str(clone)], folder, environment)
    started = time.perf_counter()
    command = ["make", name, f"PYTHON={sys.executable}"]
    output = _ended_well(command, clone, {**environment, "PHONGBENCH_CACHE": str(kernels)})
    return Goal(name, time.perf_counter() - started, output)


def _ended_well(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> str:
    """What a command printed; MeasurementError with its last lines where it failed."""
    try:
        done = subprocess.run(command, check=False, stdout=subprocess.PIPE, text=True, cwd=folder, env=environment)
    except OSError as problem:
        raise MeasurementError(f"{command[0]} cannot be run: {problem.strerror}", None, "install it") from problem
    if done.returncode:
        last = "\n".join(done.stdout.splitlines()[-20:])
        what = f"it ended with exit code {done.returncode}"
        raise MeasurementError(what, " ".join(command[:2]), f"its last lines:\n{last}")
    return done.stdout


def load_programs(root: Path) -> Path:
    """The folder that holds the load program, which only a checkout has; InputError elsewhere."""
    programs = root / "tests" / "api"
    if not (programs / "load" / "__main__.py").is_file():
        raise InputError("the load program is not there", str(programs / "load"), "run it in a checkout")
    return programs


def service(programs: Path) -> str:
    """The tables of the load program in this folder, as `make bench-api` prints them."""
    command = [sys.executable, "-m", "load", "--runs", str(runs.DEFAULT_ROOT.resolve())]
    done = subprocess.run(command, cwd=programs, check=False, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise MeasurementError(f"it ended with exit code {done.returncode}", str(programs / "load"), "see above")
    return done.stdout


def measured_scenes(progress: Progress) -> dict[str, Any]:
    """What leaving out saves in every shipped scene, and our tracer beside others."""
    skips = {
        name: skip_gains.skips(read_scene(name), size=SIZE, depth=depth, progress=progress)
        for name, depth in SCENES.items()
    }
    tracers, absent = scene_bench.tracers(read_scene(RACE), size=SIZE, depth=DEPTH, progress=progress)
    return {"skips": skips, "tracers": tracers, "absent": absent}
