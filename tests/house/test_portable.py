"""Windows and macOS: what only POSIX or only Linux has is hidden, and the library works without it."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from phongbench.compiler import clock, jit

#: modules of the standard library that Windows lacks, and functions of `os` and `time` likewise
MODULES = ("crypt", "curses", "fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty")
FUNCTIONS = {
    "os": (
        "fork", "getegid", "geteuid", "getgid", "getloadavg", "getpgid", "getuid", "killpg",
        "nice", "pread", "preadv", "pwrite", "sched_getaffinity", "sched_setaffinity", "setsid", "statvfs", "sysconf",
        "wait3", "wait4",
    ),
    "time": ("clock_getres", "clock_gettime", "clock_gettime_ns", "CLOCK_MONOTONIC", "CLOCK_MONOTONIC_RAW"),
}  # fmt: skip
#: packages that look for POSIX by themselves are imported before: what they do on Windows is theirs to test
HIDE = f"""
import importlib, json, sys
import asyncio, fastapi, filelock, jinja2, matplotlib, multiprocessing.context, pandas, PIL.Image, platformdirs
import psutil, pyarrow.parquet, rich.console, subprocess, uvicorn
for name in {MODULES!r}:
    sys.modules[name] = None
for module, names in {FUNCTIONS!r}.items():
    for name in names:
        vars(importlib.import_module(module)).pop(name, None)
"""
IMPORT = """
import pkgutil
imported = []
for root in ("phongbench", "phongbench_api", "phongbench_reports"):
    for module in pkgutil.walk_packages(importlib.import_module(root).__path__, root + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
            imported.append(module.name)
print(json.dumps(imported))
"""
STUDY = """
from dataclasses import replace
from pathlib import Path
from phongbench.inputs.plan import preset
from phongbench.results import runs
from phongbench.study.run import run_study

plan = replace(
    preset("quick"), approximations=("phong", "lyon"), alphas=(10.0,), gammas=(8,), lambda_forms=("dot",),
    slopes=("taylor",), spaces=("reflect",), precisions=("float32",), strata=("highlight",), samples=1000, probes=(),
    raw=("phong/each",), timing_budget=1.0,
).validated()
run = run_study(plan, Path(sys.argv[1])).run
print(json.dumps({"damaged": runs.verify(run), "accuracy": len(run.accuracy), "timing": len(run.timing)}))
"""


def without_posix(code: str, *words: str) -> object:
    """What the code prints, in a process without what Windows lacks."""
    done = subprocess.run([sys.executable, "-c", HIDE + code, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_module_can_be_imported() -> None:
    imported = without_posix(IMPORT)
    assert isinstance(imported, list)
    assert {"phongbench.timing.interference", "phongbench_api.serve", "phongbench_reports.drawing"} <= set(imported)


@pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")
def test_a_small_study_runs_with_its_timing(tmp_path: Path) -> None:
    told = without_posix(STUDY, str(tmp_path / "run"))
    assert isinstance(told, dict)
    assert told["damaged"] == []
    assert told["accuracy"] > 0
    assert told["timing"] > 0


@pytest.mark.skipif(jit.DISABLED, reason="nothing is compiled")
def test_compiled_code_reads_pythons_clock_where_the_c_library_has_none() -> None:
    read = jit.inline(clock.python_clock)

    @numba.njit
    def twice(stamp):  # type: ignore[no-untyped-def]
        return read(stamp), read(stamp)

    before = time.perf_counter_ns()
    first, second = twice(np.zeros(2, np.int64))
    assert before <= first <= second <= time.perf_counter_ns()
