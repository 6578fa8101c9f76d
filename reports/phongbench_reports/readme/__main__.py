"""`make docs`: fills the generated parts of README.md, the only way a number gets in there.

A part stands between `<!-- generated: NAME -->` and `<!-- /generated: NAME -->`. Everything is measured first and
written last, so a run that fails leaves README and pictures as they were.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from phongbench.benchmarks.false_alarms import Alarms
from phongbench.errors import InputError, MeasurementError, PhongbenchError
from phongbench.results import runs
from phongbench.results.runs import Run
from phongbench.support.progress import Progress
from phongbench_reports.build import write
from phongbench_reports.cuts import Study
from phongbench_reports.readme import bench_parts, run_parts
from phongbench_reports.readme.run_parts import PICTURES, Wall

NAMES = (
    "verdict",
    "front",
    "shader",
    "claims",
    "speed",
    "peers",
    "alarms",
    "throughput",
    "scenes",
    "service",
    "machine",
)
CHECKOUT = Path(__file__).resolve().parents[3]
README = "README.md"
#: bytes a picture may have: a repository keeps every version of it
LARGEST_PICTURE = 100_000
#: seconds for the rounds with the peers, and how often the twin is measured
PEER_SECONDS, REPEATS = 20.0, 200
_PART = re.compile(r"(<!-- generated: (?P<name>\w+) -->\n)(?P<body>.*?)(<!-- /generated: (?P=name) -->)", re.DOTALL)


def parts_of(text: str) -> dict[str, str]:
    """The generated parts of a text, name to body; InputError unless every one of NAMES is there once and no other."""
    found = [(part["name"], part["body"].strip()) for part in _PART.finditer(text)]
    if sorted(name for name, _ in found) != sorted(NAMES):
        there = ", ".join(name for name, _ in found) or "none"
        raise InputError(f"the generated parts are {there}", README, f"keep the marks of {', '.join(NAMES)}, each once")
    return dict(found)


def filled(text: str, bodies: Mapping[str, str]) -> str:
    """The text with its generated parts replaced; all else stays as it is."""
    parts_of(text)
    return _PART.sub(lambda part: f"{part[1]}\n{bodies[part['name']].strip()}\n\n{part[4]}", text)


def problems(root: Path) -> list[str]:
    """What is missing in the structure of README and pictures; an empty list if nothing is."""
    text = _readme(root)
    told = [f"the part {name} is empty" for name, body in parts_of(text).items() if not body]
    for name in sorted(set(re.findall(r'(?:src|srcset)="([^"]+)"', text))):
        file = root / name
        if not file.is_file():
            told.append(f"{name} is shown and not there")
        elif file.stat().st_size > LARGEST_PICTURE:
            told.append(f"{name} has {file.stat().st_size} bytes, more than {LARGEST_PICTURE}")
    return told


def _readme(root: Path) -> str:
    try:
        return (root / README).read_text(encoding="utf-8")
    except OSError as problem:
        raise InputError(f"cannot be read: {problem.strerror}", str(root / README), "run it in a checkout") from problem


def fill(
    root: Path,
    run: Run,
    compared: Mapping[str, Any],
    alarms: Sequence[Alarms],
    beside: Mapping[str, str],
    walls: Sequence[Wall] = (),
) -> None:
    """Write README's generated parts and the pictures from a finished run and what was measured beside it.

    compared  what `phongbench.benchmarks.kernel_bench.bench` found: peers, and the sweep's throughput
    alarms    what `phongbench.benchmarks.false_alarms.count` found
    beside    the parts `scenes` and `service`, as Markdown
    """
    study = Study(run)
    shown, files = run_parts.front(study)
    bodies = {
        "verdict": run_parts.verdict(study),
        "front": shown,
        "shader": run_parts.shader(study),
        "claims": run_parts.claims(run),
        "speed": run_parts.speed(study),
        "peers": bench_parts.peers(compared),
        "alarms": bench_parts.alarms(alarms),
        "throughput": run_parts.throughput(compared["sweep"], walls),
        "machine": run_parts.machine(run),
        **beside,
    }
    large = [f"{name}: {len(content)} bytes" for name, content in files.items() if len(content) > LARGEST_PICTURE]
    if large:
        raise InputError(f"a picture is too large: {', '.join(large)}", str(PICTURES), f"at most {LARGEST_PICTURE}")
    text = filled(_readme(root), bodies)
    for name, content in files.items():
        write(root / PICTURES / name, content)
    write(root / README, text.encode("utf-8"))


def study_as_command(name: str, folder: Path, cache: Path, extra: Sequence[str] = ()) -> Wall:
    """Run the quick study in a process of its own, with its kernels cached in `cache`."""
    command = [sys.executable, "-m", "phongbench", "run", "--preset", "quick", "--out", str(folder), "--json", *extra]
    started = time.perf_counter()
    done = subprocess.run(
        command,
        check=False,
        stdout=subprocess.PIPE,
        cwd=folder.parent,
        env={**os.environ, "PHONGBENCH_CACHE": str(cache)},
    )
    seconds = time.perf_counter() - started
    if done.returncode:
        raise MeasurementError(
            f"the {name} study ended with exit code {done.returncode}", "phongbench run", "see above"
        )
    return Wall(name, json.loads(done.stdout), seconds)


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


def _measured(root: Path, run_name: str | None) -> None:
    from phongbench.benchmarks.false_alarms import count
    from phongbench.benchmarks.kernel_bench import bench

    walls: list[Wall] = []
    programs = load_programs(root)
    with ExitStack() as stack:
        if run_name is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="phongbench-docs-")))
            for name in ("cold", "warm"):
                click.echo(f"the quick study, {name}", err=True)
                walls.append(study_as_command(name, folder / name, folder / "cache"))
            run_name = str(folder / "warm")
        run = runs.find(run_name, runs.DEFAULT_ROOT)
        click.echo("peers, and the sweep against plain NumPy", err=True)
        compared = bench(budget_seconds=PEER_SECONDS)
        click.echo("false alarms of the timing", err=True)
        alarms = count(REPEATS, working_sets=("l1", "l2", "memory"))
        click.echo("scenes", err=True)
        beside = {"scenes": bench_parts.scenes(bench_parts.measured_scenes(Progress()))}
        click.echo("the service under load", err=True)
        beside["service"] = service(programs)
        click.echo("drawing", err=True)
        fill(root, run, compared, alarms, beside, walls)
    click.echo(f"{README}: {', '.join(NAMES)}", err=True)


@click.command()
@click.option("--run", "run_name", metavar="RUN", help="Use this finished run; wall times of the study are left out.")
@click.option(
    "--check", is_flag=True, help="Only tell whether every generated part is there and filled; exit 1 if not."
)
@click.option("--root", type=click.Path(path_type=Path), default=CHECKOUT, help="The checkout.  [default: this one]")
def main(run_name: str | None, check: bool, root: Path) -> None:
    """Fill the generated parts of README.md by measuring on this machine; let nothing else run meanwhile."""
    try:
        if not check:
            _measured(root, run_name)
        found = problems(root)
    except PhongbenchError as problem:
        raise click.ClickException(str(problem)) from problem
    for line in found:
        click.echo(f"{README}: {line}; `make docs` fills it", err=True)
    if found:
        sys.exit(1)


if __name__ == "__main__":
    main()
