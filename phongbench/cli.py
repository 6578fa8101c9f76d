"""The command line: parse, one library call, print, exit code.

Heavy modules are imported by the command that needs them.
"""

import sys
from pathlib import Path
from typing import Any

import click

from phongbench import __version__
from phongbench.commands.answers import bench, claims, front, recommend
from phongbench.commands.common import DIFFERENT, ROOT, CommaList
from phongbench.commands.common import facts as _facts
from phongbench.commands.common import grid as _grid
from phongbench.commands.common import show as _show
from phongbench.commands.pictures import render
from phongbench.commands.serving import serving
from phongbench.commands.shaders import shader
from phongbench.commands.shading import shade
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
    """Turns deliberate errors into two lines on stderr and an exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; never a traceback for what the user can mend."""
        try:
            return super().invoke(ctx)
        except PhongbenchError as problem:
            click.echo(f"phongbench: {problem}", err=True)
            sys.exit(next(code for kind, code in EXIT_CODES if isinstance(problem, kind)))
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


def _serve(**wishes: Any) -> None:
    from phongbench_api.serve import serve
    from phongbench_api.settings import Settings

    serve(Settings(**wishes))


for command in (front, recommend, claims, bench, shade, shader, render, serving(_serve)):
    main.add_command(command)


@main.command(short_help="Run a study: accuracy, stability, timing, report.")
@click.argument("plan", required=False, type=click.Path(path_type=Path), metavar="[PLAN.toml]")
@click.option("--preset", "preset_name", metavar="quick|standard|full", help="Size of the study.  [default: quick]")
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the run.  [default: phongbench-runs/<run id>]")
@click.option("--alpha", "alphas", type=CommaList("numbers", float), help="Exponents of exact Phong, e.g. 10,50,200.")
@click.option(
    "--materials", type=click.Path(path_type=Path), metavar="FILE.mtl", help="Take the exponents from its Ns lines."
)
@click.option("--gamma", "gammas", type=CommaList("whole numbers", int), help="Powers of two, e.g. 4,8,16.")
@click.option("--lambda", "lambda_forms", type=CommaList("names"), help="dot,difference,cross,tan2")
@click.option(
    "--only",
    "approximations",
    type=CommaList("names"),
    help="Approximations to measure; see `phongbench approximations`.",
)
@click.option(
    "--with",
    "files",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE.py",
    help="Add your own approximation.",
)
@click.option(
    "--precision", "precisions", type=CommaList("names"), help="float16,bfloat16,float32,float64, fixed point as q1.15"
)
@click.option("--samples", type=int, help="Pairs for each cell and stratum.")
@click.option("--seed", type=int, help="Of all random choices; equal seeds give equal rows.")
@click.option("--probe", "probes", type=CommaList("names"), help="Stability probes to run after the sweep, or `none`.")
@click.option("--mesh", "meshes", multiple=True, metavar="FILE.obj", help="Measure interpolated normals on it, too.")
@click.option("--scenes", is_flag=True, help="Draw the shipped scenes, too: errors of pictures, and work skipped.")
@click.option("--no-timing", is_flag=True, help="Measure errors only.")
@click.option("--no-report", is_flag=True, help="Do not draw the report.")
@click.option("--timing-budget", type=float, metavar="SECONDS", help="How long the timing may take.")
@click.option("--jobs", type=click.IntRange(min=1), help="Threads.  [default: all cores]")
@click.option("--resume", is_flag=True, help="Go on with the interrupted run in --out.")
@click.option("--fresh", is_flag=True, help="Discard the run that --out holds.")
@click.option("--dry-run", is_flag=True, help="Tell cells, bytes and seconds, and stop.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def run(
    plan: Path | None, preset_name: str | None, out: Path | None, materials: Path | None, files: tuple[Path, ...],
    no_timing: bool,
    no_report: bool, jobs: int | None, resume: bool, fresh: bool, dry_run: bool, as_json: bool, **wishes: Any,
) -> None:  # fmt: skip
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
    from phongbench.approximations import registry_with
    from phongbench.plan import compose
    from phongbench.study import forecast, run_study
    from phongbench.terminal import TerminalProgress

    registry = registry_with(files)
    wishes["meshes"] = wishes["meshes"] or None
    if files and wishes["approximations"] is None and plan is None:
        wishes["approximations"] = tuple(registry)
    wanted = compose(plan, preset_name, materials, timing=False if no_timing else None, **wishes).validated(registry)
    if dry_run:
        with TerminalProgress(quiet=as_json) as progress:
            told = forecast(wanted, registry, jobs, progress).as_dict()
        _show(told, as_json, lambda: _facts(told))
        return
    with TerminalProgress(quiet=as_json) as progress:
        outcome = run_study(
            wanted, out, registry=registry, jobs=jobs, resume=resume, fresh=fresh, progress=progress,
            build_report=None if no_report else _build_report, command=("phongbench", *sys.argv[1:]),
            files=[f.name for f in files],
        )  # fmt: skip
    _show(outcome.as_dict(), as_json, lambda: _told(outcome))
    for message, count in outcome.failures.items():
        click.echo(f"{count} cells failed: {message}", err=True)
    for violation in outcome.violations:
        click.echo(f"results contradict each other: {violation}", err=True)
    if outcome.failures or outcome.violations:
        sys.exit(SOME_CELLS_FAILED)


@main.command(short_help="Draw the report of a run again.")
@click.argument("run_name", metavar="RUN")
@click.option("--out", type=click.Path(path_type=Path), help="Where to write.  [default: RUN/report]")
@click.option("--single-file", is_flag=True, help="One self-contained HTML file.")
def report(run_name: str, out: Path | None, single_file: bool) -> None:
    """Draw the report of a run: a folder that opens by double click, or one file."""
    from phongbench import results
    from phongbench_reports import build

    found = results.find(run_name, ROOT)
    click.echo(build(found, out or found.path / "report", single_file=single_file, processes=2))


@main.command("list", short_help="List the runs here.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def list_runs(as_json: bool) -> None:
    """List the runs in phongbench-runs, oldest first."""
    from phongbench import results
    from phongbench.terminal import table

    runs = [
        {"run": r.id, "state": r.manifest["state"], "preset": r.plan.preset, "path": str(r.path)}
        for r in results.stored(ROOT)
    ]
    if runs or as_json:
        _show(runs, as_json, lambda: table("", ("run", "state", "preset", "path"), [tuple(r.values()) for r in runs]))
    else:
        click.echo("no run here yet: phongbench run makes one", err=True)


@main.command(short_help="Tell what a run holds and found.")
@click.argument("run_name", metavar="RUN")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def show(run_name: str, as_json: bool) -> None:
    """Tell what a run measured, and the most accurate formulas at each exponent."""
    from phongbench import results, summary
    from phongbench.terminal import table

    found = summary.summarise(results.find(run_name, ROOT))
    _show(
        found,
        as_json,
        lambda: _facts(found["facts"]),
        lambda: table("Least error per exponent, float32 highlight", *_grid(found["best"])),
    )


@main.command(short_help="Check a run's bytes against its manifest.")
@click.argument("run_name", metavar="RUN")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def verify(run_name: str, as_json: bool) -> None:
    """Check every file of a run against its manifest; exit 1 if a byte has changed or the run is partial."""
    from phongbench import results

    found = results.find(run_name, ROOT)
    problems = results.verify(found)
    lines = "\n".join(problems) or f"{found.id}: all {len(found.manifest['files'])} files are as they were written"
    _show({"run": found.id, "problems": problems}, as_json, lambda: click.echo(lines))
    if problems:
        sys.exit(DIFFERENT)


@main.command(short_help="Tell what changed between two runs.")
@click.argument("run_a", metavar="A")
@click.argument("run_b", metavar="B")
@click.option("--metric", default="max_abs", show_default=True, help="Column of the accuracy rows.")
@click.option("--tolerance", default=0.0, type=float, help="Largest change that counts as equal.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def compare(run_a: str, run_b: str, metric: str, tolerance: float, as_json: bool) -> None:
    """Tell which accuracy rows of two runs differ; exit 1 if any does."""
    from phongbench import results
    from phongbench.compare import compare as compare_runs
    from phongbench.terminal import table

    found = compare_runs(results.find(run_a, ROOT), results.find(run_b, ROOT), metric=metric, tolerance=tolerance)
    told = found.as_dict()
    facts = {name: told[name] for name in ("metric", "equal", "changed", "only_a", "only_b")}
    largest = told["rows"][:20]
    _show(
        told, as_json, lambda: _facts(facts), *([lambda: table("Largest changes", *_grid(largest))] if largest else [])
    )
    if not found.same:
        sys.exit(DIFFERENT)


@main.command(short_help="List the approximations.")
@click.option(
    "--with", "files", multiple=True, type=click.Path(path_type=Path), metavar="FILE.py", help="Add your own."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def approximations(files: tuple[Path, ...], as_json: bool) -> None:
    """List the approximations: formula, lambda forms, spaces, beta policies, source."""
    from phongbench import summary
    from phongbench.approximations import registry_with
    from phongbench.terminal import table

    told = [summary.describe(spec) for spec in registry_with(files).values()]
    columns = ("name", "kind", "formula", "lambda_forms", "spaces", "beta_policies")
    lines = [[", ".join(a[c]) if isinstance(a[c], list) else a[c] for c in columns] for a in told]
    _show(told, as_json, lambda: table("", columns, lines))


@main.command(short_help="Check this installation and machine.")
@click.option("--timing", is_flag=True, help="Time identical code against itself, again and again, and count alarms.")
@click.option("--repeats", type=click.IntRange(min=10), default=200, show_default=True, help="How often, for --timing.")
@click.option(
    "--working-set", "working_sets", type=CommaList("names"), default="l1", show_default=True, help="Where, e.g. l1,l2."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def doctor(timing: bool, repeats: int, working_sets: tuple[str, ...], as_json: bool) -> None:
    """Check what a study needs: compiler, kernel cache, vector width, disk, report packages.

    With --timing, check the timing instead: the share of false alarms on identical code must be at most 1 %.

    Exit 1 if something is missing, or the alarms are too many.
    """
    from phongbench.terminal import table

    if timing:
        from phongbench.alarms import count

        told = [alarms.as_dict() for alarms in count(repeats, working_sets=working_sets)]
        _show(told, as_json, lambda: table("Identical code, timed against itself", *_grid(told)))
    else:
        from phongbench.doctor import examine

        found = examine()
        told = [{**c, "good": c["state"] != "bad"} for c in found]
        _show(
            found,
            as_json,
            lambda: table("", ("check", "state", "detail"), [(c["check"], c["state"], c["detail"]) for c in found]),
        )
    if not all(row["good"] for row in told):
        sys.exit(DIFFERENT)


def _build_report(found: Any, folder: Path) -> Path:
    from phongbench_reports import build

    return build(found, folder, processes=2)


def _told(outcome: Any) -> None:
    rate = outcome.evaluations / max(outcome.seconds["accuracy"], 1e-9) / 1e9
    click.echo(
        f"{outcome.cells:,} cells, {outcome.evaluations / 1e9:.2f} billion evaluations in "
        f"{outcome.seconds['accuracy']:.1f} s ({rate:.2f} billion/s, compiling included); "
        f"all in {outcome.seconds['total']:.1f} s"
    )
    click.echo(f"run     {outcome.run.path}")
    if outcome.report:
        click.echo(f"report  {outcome.report}")
