"""What the pages tell beside a run: measured here, on this machine, while nothing else runs."""

import subprocess
import sys
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
