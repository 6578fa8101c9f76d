"""Stored runs: what there are, what they hold, whether their bytes are whole, what differs between two."""

import sys

import click

from phongbench.cli.common import DIFFERENT, JSON, ROOT, facts, grid, show


@click.command("list", short_help="List the runs here.")
@JSON
def list_runs(as_json: bool) -> None:
    """List the runs in phongbench-runs, oldest first."""
    from phongbench.cli.terminal import table
    from phongbench.results import runs as results

    runs = [
        {"run": r.id, "state": r.manifest["state"], "preset": r.plan.preset, "path": str(r.path)}
        for r in results.stored(ROOT)
    ]
    if runs or as_json:
        show(runs, as_json, lambda: table("", ("run", "state", "preset", "path"), [tuple(r.values()) for r in runs]))
    else:
        click.echo("no run here yet: phongbench run makes one", err=True)


@click.command("show", short_help="Tell what a run holds and found.")
@click.argument("run_name", metavar="RUN")
@JSON
def show_run(run_name: str, as_json: bool) -> None:
    """Tell what a run measured, and the most accurate formulas at each exponent."""
    from phongbench.analysis import summary
    from phongbench.cli.terminal import table
    from phongbench.results import runs as results

    found = summary.summarise(results.find(run_name, ROOT))
    show(
        found,
        as_json,
        lambda: facts(found["facts"]),
        lambda: table("Least error per exponent, float32 highlight", *grid(found["best"])),
    )


@click.command(short_help="Check a run's bytes against its manifest.")
@click.argument("run_name", metavar="RUN")
@JSON
def verify(run_name: str, as_json: bool) -> None:
    """Check every file of a run against its manifest; exit 1 if a byte has changed or the run is partial."""
    from phongbench.results import runs as results

    found = results.find(run_name, ROOT)
    problems = results.verify(found)
    lines = "\n".join(problems) or f"{found.id}: all {len(found.manifest['files'])} files are as they were written"
    show({"run": found.id, "problems": problems}, as_json, lambda: click.echo(lines))
    if problems:
        sys.exit(DIFFERENT)


@click.command(short_help="Tell what changed between two runs.")
@click.argument("run_a", metavar="A")
@click.argument("run_b", metavar="B")
@click.option("--metric", default="max_abs", show_default=True, help="Column of the accuracy rows.")
@click.option("--tolerance", default=0.0, type=float, help="Largest change that counts as equal.")
@JSON
def compare(run_a: str, run_b: str, metric: str, tolerance: float, as_json: bool) -> None:
    """Tell which accuracy rows of two runs differ; exit 1 if any does."""
    from phongbench.analysis.compare import compare as compare_runs
    from phongbench.cli.terminal import table
    from phongbench.results import runs as results

    found = compare_runs(results.find(run_a, ROOT), results.find(run_b, ROOT), metric=metric, tolerance=tolerance)
    told = found.as_dict()
    summed = {name: told[name] for name in ("metric", "equal", "changed", "only_a", "only_b")}
    largest = told["rows"][:20]
    show(told, as_json, lambda: facts(summed), *([lambda: table("Largest changes", *grid(largest))] if largest else []))
    if not found.same:
        sys.exit(DIFFERENT)
