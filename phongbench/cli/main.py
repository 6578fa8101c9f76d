"""The command line: parse, one library call, print, exit code.

Heavy modules are imported by the command that needs them.
"""

import errno
import io
import sys
import warnings
from pathlib import Path
from typing import Any

import click

from phongbench import __version__
from phongbench.cli.answers import bench, claims, front, recommend
from phongbench.cli.common import JSON, PATH, ROOT, WITH, CommaList, facts, notes, show
from phongbench.cli.installation import approximations, doctor
from phongbench.cli.inverse import inverse
from phongbench.cli.pictures import render
from phongbench.cli.runs import compare, list_runs, show_run, verify
from phongbench.cli.serving import serve
from phongbench.cli.shaders import shader
from phongbench.cli.shading import shade
from phongbench.cli.targets import targets
from phongbench.errors import (
    CorruptRunError,
    InputError,
    InterruptedStudyError,
    LockedError,
    MeasurementError,
    PhongbenchError,
    StorageError,
)

#: the one table from errors to exit codes
EXIT_CODES: tuple[tuple[type[PhongbenchError], int], ...] = (
    (LockedError, 4),
    (StorageError, 5),
    (CorruptRunError, 6),
    (InputError, 2),
    (MeasurementError, 3),
    (InterruptedStudyError, 130),
    (PhongbenchError, 1),
)
SOME_CELLS_FAILED, INTERRUPTED = 3, 130


class Commands(click.Group):
    """Turns deliberate errors into two lines on stderr and an exit code, warnings into one."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse an empty word: it is a variable that was not set, and would count as what is usual."""
        for before, word in zip(["phongbench", *args], args, strict=False):
            if not word or (word.startswith("--") and word.endswith("=")):
                raise click.UsageError(f"what follows {word.rstrip('=') or before} is empty", ctx)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; never a traceback for what the user can fix."""
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(errors="replace")  # a locale may have no character for a sign of a table
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_: click.echo(f"phongbench: {message}", err=True)
                return super().invoke(ctx)
        except PhongbenchError as problem:
            click.echo(f"phongbench: {problem}", err=True)
            sys.exit(next(code for kind, code in EXIT_CODES if isinstance(problem, kind)))
        except OSError as problem:
            if problem.errno == errno.EPIPE:  # who read the output has seen enough
                raise
            place = f"{problem.filename}: " if problem.filename else ""
            click.echo(f"phongbench: {place}the system refuses: {problem.strerror or problem}", err=True)
            sys.exit(next(code for kind, code in EXIT_CODES if kind is StorageError))
        except KeyboardInterrupt:
            click.echo("phongbench: interrupted", err=True)
            sys.exit(INTERRUPTED)


EXAMPLES = """\b
Examples:
  phongbench run                                  a quick study and its report, in under a minute
  phongbench run --alpha 10,50,200 --only lyon,gaussian
  phongbench run --materials scene.mtl --preset standard --out my-study
  phongbench report latest --single-file          the report as one file to send around
  phongbench show latest                          what the newest run found
  phongbench recommend --alpha 50 --max-error 1/255
"""


@click.group(
    cls=Commands, help=f"Which specular-highlight formula to ship, by measured error and run time.\n\n{EXAMPLES}"
)
@click.version_option(__version__, prog_name="phongbench")
def main() -> None:
    """Entry point."""


for command in (
    list_runs, show_run, verify, compare, front, recommend, claims, approximations, targets, doctor, bench, shade,
    shader, render, inverse, serve,
):  # fmt: skip
    main.add_command(command)


@main.command(short_help="Run a study: accuracy, stability, timing, report.")
@click.argument("plan", required=False, type=PATH, metavar="[PLAN.toml]")
@click.option("--preset", "preset_name", metavar="quick|standard|full", help="Size of the study.  [default: quick]")
@click.option("--out", type=PATH, help="Folder of the run.  [default: phongbench-runs/<run id>]")
@click.option("--alpha", "alphas", type=CommaList("numbers", float), help="Exponents of exact Phong, e.g. 10,50,200.")
@click.option("--materials", type=PATH, metavar="FILE.mtl", help="Take the exponents from its Ns lines.")
@click.option("--gamma", "gammas", type=CommaList("whole numbers", int), help="Powers of two, e.g. 4,8,16.")
@click.option("--lambda", "lambda_forms", type=CommaList("names"), help="dot,difference,cross,tan2")
@click.option(
    "--only",
    "approximations",
    type=CommaList("names"),
    help="Approximations to measure; see `phongbench approximations`.",
)
@WITH
@click.option(
    "--precision", "precisions", type=CommaList("names"), help="float16,bfloat16,float32,float64, fixed point as q1.15"
)
@click.option("--samples", type=int, help="Pairs for each cell and stratum.")
@click.option("--seed", type=int, help="Of all random choices; equal seeds give equal rows.")
@click.option("--probe", "probes", type=CommaList("names"), help="Stability probes to run after the sweep, or `none`.")
@click.option("--mesh", "meshes", multiple=True, metavar="FILE.obj", help="Measure interpolated normals on it, too.")
@click.option("--scenes", is_flag=True, help="Draw the shipped scenes, too: errors of pictures, and work skipped.")
@click.option("--target", "targets", type=CommaList("names"), help="Keep costs of these alone, e.g. cpu,rdna2.")
@click.option("--no-timing", is_flag=True, help="Measure errors only.")
@click.option("--no-report", is_flag=True, help="Do not draw the report.")
@click.option("--timing-budget", type=float, metavar="SECONDS", help="How long the timing may take.")
@click.option("--jobs", type=click.IntRange(min=1), help="Threads.  [default: all cores]")
@click.option("--resume", is_flag=True, help="Go on with the interrupted run in --out.")
@click.option("--fresh", is_flag=True, help="Discard the run that --out holds.")
@click.option("--dry-run", is_flag=True, help="Tell cells, bytes and seconds, and stop.")
@JSON
def run(
    plan: Path | None,
    preset_name: str | None,
    out: Path | None,
    materials: Path | None,
    files: tuple[Path, ...],
    no_timing: bool,
    no_report: bool,
    jobs: int | None,
    resume: bool,
    fresh: bool,
    dry_run: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Run a study: accuracy, stability, timing, and a report.

    \b
    Examples:
      phongbench run
      phongbench run --alpha 10,50,200 --gamma 4,8,16 --lambda dot,cross
      phongbench run --with my_highlight.py --only lyon,my-highlight
      phongbench run --preset standard --out study        (interrupted? add --resume)
      phongbench run plan.toml --dry-run

    A plan file holds any of these, e.g.  alphas = [10, 50]  gammas = [8]  precisions = ["float32"]  samples = 100000
    """
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.formulas.user_files import registry_with
    from phongbench.inputs.plan import preset, with_own
    from phongbench.inputs.plan_files import compose
    from phongbench.study.forecast import forecast
    from phongbench.study.run import run_study

    registry = registry_with(files)
    options["meshes"] = options["meshes"] or None
    if options["approximations"] is None and plan is None:  # plug-ins and the user's own among them
        options["approximations"] = with_own(preset(preset_name or "quick"), registry)
    options |= {"timing": False if no_timing else None, "note": lambda text: notes([text], quiet=as_json)}
    wanted = compose(plan, preset_name, materials, **options).validated(registry)
    if dry_run:
        with TerminalProgress(quiet=as_json) as progress:
            prediction = forecast(wanted, registry, jobs, progress).as_dict()
        show(prediction, as_json, lambda: facts(prediction))
        return
    with TerminalProgress(quiet=as_json) as progress:
        outcome = run_study(
            wanted,
            out,
            registry=registry,
            jobs=jobs,
            resume=resume,
            fresh=fresh,
            progress=progress,
            build_report=None if no_report else _build_report,
            command=("phongbench", *sys.argv[1:]),
            files=[f.name for f in files],
        )
    show(outcome.as_dict(), as_json, lambda: _summary(outcome))
    _exit_on_failures(outcome)


@main.command(short_help="Draw the report of a run again.")
@click.argument("run_name", metavar="RUN")
@click.option("--out", type=PATH, help="Folder to write into, or a .html with --single-file.  [default: RUN/report]")
@click.option("--single-file", is_flag=True, help="One self-contained HTML file.")
def report(run_name: str, out: Path | None, single_file: bool) -> None:
    """Draw the report of a run: a folder that opens by double click, or one file.

    Of an interrupted run it tells what was measured, as soon as there are errors.
    """
    from phongbench.results import runs
    from phongbench_reports import build

    run = runs.find(run_name, ROOT)
    lacking = runs.unfinished(runs.require_rows(run))
    notes([f"{lacking}; {runs.FINISH}"] if lacking else [])
    click.echo(build(run, out or run.path / "report", single_file=single_file, processes=2))


def _build_report(run: Any, folder: Path) -> Path:
    from phongbench_reports import build

    return build(run, folder, processes=2)


def _exit_on_failures(outcome: Any) -> None:
    for message, count in outcome.failures.items():
        click.echo(f"{count} cells failed: {message}", err=True)
    for violation in outcome.violations:
        click.echo(f"results contradict each other: {violation}", err=True)
    if outcome.failures or outcome.violations:
        sys.exit(SOME_CELLS_FAILED)


def _summary(outcome: Any) -> None:
    rate = outcome.evaluations / max(outcome.seconds["accuracy"], 1e-9) / 1e9
    click.echo(
        f"{outcome.cells:,} cells, {outcome.evaluations / 1e9:.2f} billion evaluations in "
        f"{outcome.seconds['accuracy']:.1f} s ({rate:.2f} billion/s, compiling included); "
        f"all in {outcome.seconds['total']:.1f} s"
    )
    click.echo(f"run     {outcome.run.path}")
    if outcome.report:
        click.echo(f"report  {outcome.report}")
