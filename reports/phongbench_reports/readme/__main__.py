"""`make docs`: fills the generated parts of README.md and of the guide, the only way a number gets in there."""

import sys
import tempfile
from pathlib import Path

import click

from phongbench.errors import PhongbenchError
from phongbench.results import runs
from phongbench_reports.readme.fill import fill, write
from phongbench_reports.readme.fill import of_run as parts_of_run
from phongbench_reports.readme.measurements import Wall, load_programs, measure, study_as_command
from phongbench_reports.readme.parts import NAMES, PAGES, problems

CHECKOUT = Path(__file__).resolve().parents[3]


def _say(text: str) -> None:
    click.echo(text, err=True)


def _fill(root: Path, run_name: str | None) -> None:
    walls: list[Wall] = []
    programs = load_programs(root)
    with tempfile.TemporaryDirectory(prefix="phongbench-docs-") as name:
        folder = Path(name)
        if run_name is None:
            for state in ("cold", "warm"):
                _say(f"the quick study, {state}")
                walls.append(study_as_command(state, folder / state, folder / "cache"))
        run = runs.find(run_name or str(folder / "warm"), runs.DEFAULT_ROOT)
        measured = measure(programs, _say, walls)
        _say("drawing")
        fill(root, run, measured)
    _say(f"{', '.join(PAGES)}: {', '.join(NAMES)}")


@click.command()
@click.option("--run", "run_name", metavar="RUN", help="Use this finished run; wall times of the study are left out.")
@click.option("--of-run", is_flag=True, help="Only the parts that the run of --run gives; the others stay as they are.")
@click.option("--check", is_flag=True, help="Only check that every generated part is there and filled; exit 1 if not.")
@click.option("--root", type=click.Path(path_type=Path), default=CHECKOUT, help="The checkout.  [default: this one]")
def main(run_name: str | None, of_run: bool, check: bool, root: Path) -> None:
    """Fill the generated parts of README.md and of reports/docs by measuring here; let nothing else run meanwhile."""
    try:
        if of_run:
            write(root, *parts_of_run(runs.find(run_name or "latest", runs.DEFAULT_ROOT)))
        elif not check:
            _fill(root, run_name)
        lacking = problems(root)
    except PhongbenchError as problem:
        raise click.ClickException(str(problem)) from problem
    for line in lacking:
        _say(f"{line}; `make docs` fills it")
    if lacking:
        sys.exit(1)


if __name__ == "__main__":
    main()
