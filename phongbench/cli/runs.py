"""Stored runs: what there are, what they hold, whether their bytes are whole, what differs between two."""

import sys

import click

from phongbench.cli.common import DIFFERENT, JSON, ROOT, CommaList, facts, grid, show


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


@click.command("show", short_help="What a run holds, in short.")
@click.argument("run_name", metavar="RUN")
@click.option("--target", "targets", type=CommaList("names"), default="", help="What to ship there, e.g. cpu,rdna2.")
@JSON
def show_run(run_name: str, targets: tuple[str, ...], as_json: bool) -> None:
    """Show what a run measured, the most accurate formulas at each exponent, and the light of their lobes.

    With --target, first what to ship on each of them: the cheapest formula within one 8-bit code, which is proven.

    \b
    Examples:
      phongbench show latest
      phongbench show latest --target cpu,rdna2,gcn4
    """
    from phongbench.analysis import summary
    from phongbench.cli.terminal import table, target_answers
    from phongbench.results import runs as results

    document = summary.summarise(results.find(run_name, ROOT), targets, ROOT)
    title = f"Least sampled error per exponent, {document['precision']} highlight; not promised"
    lobes = document["lobes"]
    sent = "Lobes over Phong's, light along the normal"
    show(
        document,
        as_json,
        lambda: facts(document["facts"]),
        lambda: target_answers(document["answers"]) if targets else None,
        lambda: table(title, *grid(document["best"])),
        lambda: table(sent, *grid(lobes)) if lobes else None,
    )


@click.command(short_help="Check a run's bytes against its manifest.")
@click.argument("run_name", metavar="RUN")
@JSON
def verify(run_name: str, as_json: bool) -> None:
    """Check every file of a run against its manifest; exit 1 if a byte has changed or the run is partial."""
    from phongbench.results import runs as results

    run = results.find(run_name, ROOT)
    problems = results.verify(run)
    lines = "\n".join(problems) or f"{run.id}: all {len(run.manifest['files'])} files are as they were written"
    show({"run": run.id, "problems": problems}, as_json, lambda: click.echo(lines))
    if problems:
        sys.exit(DIFFERENT)


@click.command(short_help="What changed between two runs.")
@click.argument("run_a", metavar="A")
@click.argument("run_b", metavar="B")
@click.option("--metric", default="max_abs", show_default=True, help="Column of the accuracy rows.")
@click.option("--tolerance", default=0.0, type=float, help="Largest change that counts as equal.")
@JSON
def compare(run_a: str, run_b: str, metric: str, tolerance: float, as_json: bool) -> None:
    """Show which accuracy rows of two runs differ; exit 1 if any does."""
    from phongbench.analysis.compare import compare as compare_runs
    from phongbench.cli.terminal import table
    from phongbench.results import runs as results

    found = compare_runs(results.find(run_a, ROOT), results.find(run_b, ROOT), metric=metric, tolerance=tolerance)
    document = found.as_dict()
    summed = {name: document[name] for name in ("metric", "equal", "changed", "only_a", "only_b")}
    largest = document["rows"][:20]
    show(
        document, as_json, lambda: facts(summed), lambda: table("Largest changes", *grid(largest)) if largest else None
    )
    if not found.same:
        sys.exit(DIFFERENT)
