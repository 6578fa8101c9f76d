"""`make docs`: fills the generated parts of README.md and of the guide, the only way a number gets in there."""

import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from phongbench.benchmarks import false_alarms, kernel_bench
from phongbench.benchmarks.study_bench import study_as_command
from phongbench.errors import InputError, PhongbenchError
from phongbench.results import runs
from phongbench.support.process import cores
from phongbench.support.progress import Progress
from phongbench_reports.readme import bench_parts, heads_part, measurements, pictures, roofline_part, scale_part, tour
from phongbench_reports.readme.fill import of_run, write
from phongbench_reports.readme.measurements import PEER_SECONDS, REPEATS, load_programs
from phongbench_reports.readme.parts import problems

CHECKOUT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Wanted:
    """What a step is given.

    root      the checkout
    run_name  a finished run that stands for a new study; None: measure one
    """

    root: Path
    run_name: str | None


#: parts by name, and pictures and the notebook by their path
Made = tuple[Mapping[str, str], Mapping[str, bytes]]


def _study(wanted: Wanted) -> Made:
    if wanted.run_name is not None:
        return of_run(runs.find(wanted.run_name, runs.DEFAULT_ROOT)), {}
    with tempfile.TemporaryDirectory(prefix="phongbench-docs-") as name:
        folder = Path(name)
        walls = [study_as_command(state, folder / state, folder / "cache") for state in ("cold", "warm")]
        return {**of_run(runs.load(folder / "warm")), "times": bench_parts.times(walls)}, {}


def _peers(_: Wanted) -> Made:
    compared = kernel_bench.bench(budget_seconds=PEER_SECONDS)
    return {"peers": bench_parts.peers(compared), "throughput": bench_parts.throughput(compared["sweep"])}, {}


def _rooflines(_: Wanted) -> Made:
    return {"rooflines": roofline_part.rooflines(roofline_part.measured())}, {}


def _alarms(_: Wanted) -> Made:
    counts = false_alarms.count(REPEATS, working_sets=("l1", "l2", "memory"))
    return {"alarms": bench_parts.alarms(counts)}, {}


def _scenes(_: Wanted) -> Made:
    return {"scenes": bench_parts.scenes(measurements.measured_scenes(Progress()))}, {}


def _service(wanted: Wanted) -> Made:
    return {"service": measurements.service(load_programs(wanted.root))}, {}


def _heads(_: Wanted) -> Made:
    return {"heads": heads_part.heads()}, {}


def _scale(_: Wanted) -> Made:
    return {"predicted": scale_part.predicted()}, {}


def _pictures(_: Wanted) -> Made:
    files = {pictures.SPHERES: pictures.spheres(), pictures.EXPLORER: pictures.explorer(runs.DEFAULT_ROOT)}
    return {"pictures": pictures.part()}, {f"{pictures.PICTURES}/{name}": content for name, content in files.items()}


def _tour(_: Wanted) -> Made:
    with tempfile.TemporaryDirectory(prefix="phongbench-tour-") as name:
        return {}, {"reports/docs/tour.ipynb": tour.notebook(tour.executed(Path(name)))}


def _goals(wanted: Wanted) -> Made:
    with tempfile.TemporaryDirectory(prefix="phongbench-goals-") as name:
        made = [measurements.goal_in_clone(goal, wanted.root, Path(name)) for goal in ("run", "test")]
    return {"goals": bench_parts.goals(made, cores())}, {}


#: step -> what it measures or draws; each is written as soon as it is made
STEPS: Mapping[str, Callable[[Wanted], Made]] = {
    "study": _study,
    "peers": _peers,
    "rooflines": _rooflines,
    "alarms": _alarms,
    "scenes": _scenes,
    "service": _service,
    "heads": _heads,
    "scale": _scale,
    "pictures": _pictures,
    "tour": _tour,
    "goals": _goals,
}


def _chosen(only: str | None) -> list[str]:
    names = list(STEPS) if only is None else [name.strip() for name in only.split(",")]
    unknown = [name for name in names if name not in STEPS]
    if unknown:
        raise InputError(f"there is no step {', '.join(unknown)}", "--only", f"known: {', '.join(STEPS)}")
    return names


@click.command()
@click.option(
    "--run", "run_name", metavar="RUN", help="Use this finished run; wall times of the study stay as they are."
)
@click.option("--only", metavar="STEPS", help=f"Only these, the others stay as they are: {', '.join(STEPS)}.")
@click.option("--check", is_flag=True, help="Only check that every generated part is there and filled; exit 1 if not.")
@click.option("--root", type=click.Path(path_type=Path), default=CHECKOUT, help="The checkout.  [default: this one]")
def main(run_name: str | None, only: str | None, check: bool, root: Path) -> None:
    """Fill the generated parts of README.md and of reports/docs by measuring here; let nothing else run meanwhile.

    What is interrupted goes on with --only: a step's parts are written when it ends.
    """
    try:
        names = [] if check else _chosen(only)
        if "service" in names:
            load_programs(root)  # before anything is measured
        for name in names:
            click.echo(name, err=True)
            write(root, *STEPS[name](Wanted(root, run_name)))
        lacking = problems(root)
    except PhongbenchError as problem:
        raise click.ClickException(str(problem)) from problem
    for line in lacking:
        click.echo(line, err=True)
    if lacking:
        sys.exit(1)


if __name__ == "__main__":
    main()
