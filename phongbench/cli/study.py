"""Studies: `run` measures one and says what to ship, `report` draws it again."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, ROOT, WITH, CommaList, ExponentList, facts, notes, show
from phongbench.cli.shards import CPU_NAME, cluster_engine, measure_shard, pin_processor, shard_in
from phongbench.cli.study_answers import build_report, exit_on_failures, summary
from phongbench.errors import InputError


@click.command(short_help="Run a study: accuracy, stability, timing, report.")
@click.argument("plan", required=False, type=PATH, metavar="[PLAN.toml]")
@click.option("--preset", "preset_name", metavar="quick|standard|full", help="Size of the study.  [default: quick]")
@click.option("--out", type=PATH, help="Folder of the run.  [default: phongbench-runs/<run id>]")
@click.option("--alpha", "alphas", type=ExponentList(), help="Exponents of exact Phong: 10,50,200, or a range 20..80.")
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
@click.option(
    "--cluster", metavar="ADDRESS|local:N", help="Sweep on a Dask cluster: its scheduler, its file, or N processes."
)
@click.option("--shard", metavar="I/N", help="Measure one of N parts of the sweep; `phongbench merge` joins them.")
@CPU_NAME
@click.option("--resume", is_flag=True, help="Go on with the interrupted run in --out, by the plan it keeps.")
@click.option("--fresh", is_flag=True, help="Discard the run that --out holds.")
@click.option("--dry-run", is_flag=True, help="Tell cells, bytes and seconds, and stop.")
@click.option("--cores", type=click.IntRange(min=1), help="With --dry-run: so many, of a cluster.")
@click.option("--verbose", is_flag=True, help="Tell what was noticed about single numbers, too.")
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
    cluster: str | None,
    shard: str | None,
    cpu_name: str | None,
    resume: bool,
    fresh: bool,
    dry_run: bool,
    cores: int | None,
    verbose: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Run a study: accuracy, stability, timing, and a report.

    \b
    Examples:
      phongbench run
      phongbench run --alpha 10,50,200 --gamma 4,8,16 --lambda dot,cross
      phongbench run --with my_highlight.py --only lyon,my-highlight
      phongbench run --alpha 20..80 --no-timing
      phongbench run --preset standard --out study
      phongbench run --resume --out study                 (after an interruption)
      phongbench run plan.toml --dry-run

    A plan file holds any of these, e.g.  alphas = [10, 50]  gammas = [8]  precisions = ["float32"]  samples = 100000
    """
    if cores and not dry_run:
        raise InputError("only a forecast is for other cores", "--cores", "add --dry-run, or limit a run by --jobs")
    pin_processor(cpu_name)
    from phongbench.formulas.user_files import registry_with
    from phongbench.study.run_folder import stored_plan

    registry = registry_with(files)
    options["timing"] = False if no_timing else None
    options["meshes"] = options["meshes"] or None
    names = [file.name for file in files]
    asked = [plan, preset_name, materials, *(value or None for value in options.values())]
    if resume and all(value is None for value in asked):
        out = out or _interrupted()
        wanted, shard = stored_plan(out, names).validated(registry), shard or shard_in(out)
    else:
        wanted = _composed(plan, preset_name, materials, registry, quiet=as_json, **options)
    given: dict[str, Any] = {"registry": registry, "jobs": jobs, "resume": resume, "fresh": fresh}
    given["command"] = ("phongbench", *sys.argv[1:])
    if dry_run:
        _forecast(wanted, registry, jobs, cores, shard, as_json)
    elif shard and not cluster:
        measure_shard(wanted, shard, out, files, given, as_json)
    else:
        given["engine"] = cluster_engine(cluster, shard, files)
        given |= {"build_report": None if no_report else build_report, "files": names}
        _measure(wanted, out, given, as_json, verbose)


def _measure(plan: Any, out: Path | None, given: dict[str, Any], as_json: bool, verbose: bool) -> None:
    """Run a study and say what came of it; given: further arguments of `run_study`."""
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.study.run import run_study

    with TerminalProgress(quiet=as_json, verbose=verbose) as progress:
        outcome = run_study(plan, out, progress=progress, **given)
    show(outcome.as_dict(), as_json, lambda: summary(outcome))
    exit_on_failures(outcome)


def _forecast(
    plan: Any, registry: Mapping[str, Any], jobs: int | None, cluster: int | None, shard: str | None, as_json: bool
) -> None:
    """Tell what a plan, or a shard of it, would take by so many threads here, or its sweep by a cluster's cores."""
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.study.forecast import forecast
    from phongbench.study.shards import ShardName

    part = ShardName.parsed(shard) if shard else None
    with TerminalProgress(quiet=as_json) as progress:
        told = forecast(plan, registry, jobs, progress, cluster, part).as_dict()
    show(told, as_json, lambda: facts(told))


def _composed(
    plan: Path | None,
    preset_name: str | None,
    materials: Path | None,
    registry: Mapping[str, Any],
    *,
    quiet: bool,
    **options: Any,
) -> Any:
    """The plan of a file or preset and these options; whatever is installed or given is measured unless they choose."""
    from phongbench.inputs.plan import preset, with_own
    from phongbench.inputs.plan_files import compose

    if options["approximations"] is None and plan is None:
        options["approximations"] = with_own(preset(preset_name or "quick"), registry)
    options["note"] = lambda text: notes([text], quiet=quiet)
    return compose(plan, preset_name, materials, **options).validated(registry)


def _interrupted() -> Path:
    """The newest interrupted run here."""
    from phongbench.results import runs

    partial = [run for run in runs.stored(ROOT) if not run.complete and not runs.measured_shard(run)]
    if not partial:
        raise InputError(
            "there is nothing to resume", str(ROOT), "give the folder of the interrupted run: --out FOLDER"
        )
    return partial[-1].path


@click.command(short_help="Draw the report of a run again.")
@click.argument("run_name", metavar="RUN")
@click.option("--out", type=PATH, help="Folder to write into, or a .html with --single-file.  [default: RUN/report]")
@click.option("--single-file", is_flag=True, help="One self-contained HTML file.")
def report(run_name: str, out: Path | None, single_file: bool) -> None:
    """Draw the report of a run: a folder that opens by double click, or one file.

    Of an interrupted run it tells what was measured, as soon as there are errors. A folder that holds the report
    already, whole and drawn of the same run by the same version, is left as it is.
    """
    from phongbench.results import runs
    from phongbench_reports.kept import there

    run = runs.find(run_name, ROOT)
    folder = out or run.path / "report"
    page = None if single_file else there(run, folder)
    lacking = runs.unfinished(run if page else runs.require_rows(run))
    notes([f"{lacking}; {runs.remedy(run)}"] if lacking else [])
    click.echo(page or _drawn(run, folder, single_file=single_file))


def _drawn(run: Any, folder: Path, *, single_file: bool) -> Path:
    """The page of a report that is drawn now."""
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.support.progress import Reached
    from phongbench_reports import build

    with TerminalProgress() as progress:
        progress.stage("drawing the report", 1.0)
        return build(run, folder, single_file=single_file, processes=2, progress=Reached(progress))
