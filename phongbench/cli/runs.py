"""Stored runs: what there are, what they hold, whether their bytes are whole, what differs between two."""

import shlex
import sys
from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import DIFFERENT, JSON, ROOT, CommaList, facts, grid, say, show
from phongbench.errors import InputError
from phongbench.support.user_paths import is_folder


@click.command("list", short_help="List the runs here.")
@JSON
def list_runs(as_json: bool) -> None:
    """List the runs in phongbench-runs, oldest first: what each measured, its size, and whether it is complete."""
    from phongbench.analysis.listing import listed
    from phongbench.cli.layout import table
    from phongbench.results import runs as results

    runs = [listed(run) for run in results.stored(ROOT)]
    columns = ("run", "study", "exponents", "precisions", "timed", "size", "state")
    if runs or as_json:
        show(runs, as_json, lambda: table("", columns, [_line(run) for run in runs], right=("size",)))
    else:
        say("no run here yet: phongbench run makes one", err=True)


def _line(run: dict[str, Any]) -> tuple[str, ...]:
    """A run as people read it: a few exponents as they are, many by their number and ends."""
    alphas, precisions = run["alphas"], ", ".join(run["precisions"])
    few = len(alphas) <= 3
    exponents = ", ".join(f"{a:g}" for a in alphas) if few else f"{len(alphas)} in {alphas[0]:g} .. {alphas[-1]:g}"
    timed, size = "yes" if run["timed"] else "no", f"{run['bytes'] / 2**20:.1f} MiB"
    return run["run"], run["study"], exponents, precisions, timed, size, run["state"]


@click.command("show", short_help="What a run says to ship, and what it holds.")
@click.argument("run_name", metavar="RUN")
@click.option("--target", "targets", type=CommaList("names"), default="", help="What to ship there, e.g. cpu,rdna2.")
@click.option("--verbose", is_flag=True, help="The least errors and the lobes, too.")
@JSON
def show_run(run_name: str, targets: tuple[str, ...], verbose: bool, as_json: bool) -> None:
    """Show what a run measured, and what it says to ship: the cheapest formula within one 8-bit code, which is proven.

    With --target, too, what to ship on each of them. --verbose tells the most accurate formulas at each exponent, and
    the light of their lobes.

    \b
    Examples:
      phongbench show latest
      phongbench show latest --target cpu,rdna2,gcn4
    """
    from phongbench.cli.answer_tables import target_answers
    from phongbench.cli.layout import table
    from phongbench.cli.verdict_table import next_commands, verdict_table
    from phongbench.results import runs as results
    from phongbench.results.answering import kept

    run = results.find(run_name, ROOT)
    document = kept(run, ROOT, summary_of, targets=targets)
    found = document["verdict"]
    title = f"Least sampled error per exponent, {document['precision']} highlight; not promised"
    lobes = document["lobes"]
    sent = "Lobes over Phong's, light along the normal"
    show(
        document,
        as_json,
        lambda: facts(document["facts"]),
        lambda: verdict_table(found) if found else None,
        lambda: target_answers(document["answers"]) if targets else None,
        lambda: table(title, *grid(document["best"])) if verbose else None,
        lambda: table(sent, *grid(lobes)) if lobes and verbose else None,
        lambda: next_commands(found, run_name if run_name == "latest" else shlex.quote(run_name)) if found else None,
    )


def summary_of(run: Any, *, targets: tuple[str, ...], root: Path) -> dict[str, Any]:
    """What a run holds and says to ship, where it is not kept."""
    from phongbench.analysis.choices import Choices
    from phongbench.analysis.summary import summarise
    from phongbench.analysis.verdict import verdict

    return {**summarise(run, targets, root), "verdict": verdict(Choices.of(run)) if run.records("accuracy") else None}


@click.command(short_help="Check a run's bytes against its manifest.")
@click.argument("run_name", metavar="RUN")
@JSON
def verify(run_name: str, as_json: bool) -> None:
    """Check every file of a run against its manifest; exit 1 if a byte has changed or the run is partial."""
    from phongbench.results import runs as results

    run = results.find(run_name, ROOT)
    problems = results.verify(run)
    lines = "\n".join(problems) or f"{run.id}: all {len(run.manifest['files'])} files are as they were written"
    show({"run": run.id, "problems": problems}, as_json, lambda: say(lines))
    if problems:
        sys.exit(DIFFERENT)


@click.command(short_help="What changed between two runs, or two ledgers.")
@click.argument("run_a", metavar="A")
@click.argument("run_b", metavar="B")
@click.option("--metric", help="Column of the accuracy rows.  [default: max_abs]")
@click.option("--tolerance", type=float, help="Largest change that counts as equal.  [default: 0]")
@JSON
def compare(run_a: str, run_b: str, metric: str | None, tolerance: float | None, as_json: bool) -> None:
    """Show which accuracy rows of two runs differ, and which times; exit 1 if any accuracy row does.

    Times are compared as ratios to exact Phong's in the same run, and only where both were timed on one machine.

    Of two ledgers that `phongbench bench` wrote on one machine it tells which times moved, as ratios over those of a
    yardstick; exit 0 whatever moved.

    \b
    Examples:
      phongbench compare study-a study-b --tolerance 1e-6
      phongbench compare before.json after.json
    """
    ledgers = [name for name in (run_a, run_b) if name.lower().endswith(".json") and not is_folder(name)]
    if len(ledgers) == 1:
        raise InputError("one is a ledger and the other a run", ledgers[0], "compare two ledgers, or two runs")
    if not ledgers:
        _compare_runs(run_a, run_b, metric or "max_abs", tolerance or 0.0, as_json)
    elif metric is not None or tolerance is not None:
        raise click.UsageError("--metric and --tolerance are of runs: leave them away for ledgers")
    else:
        _compare_ledgers(run_a, run_b, as_json)


def _compare_ledgers(file_a: str, file_b: str, as_json: bool) -> None:
    """Show what moved between two performance ledgers."""
    from phongbench.analysis.compare_ledgers import compare_ledgers
    from phongbench.cli.bench_tables import ledger_tables
    from phongbench.results.ledgers import read

    found = compare_ledgers(read(Path(file_a)), read(Path(file_b)), second=file_b)
    show(found, as_json, lambda: ledger_tables(found))


def _compare_runs(run_a: str, run_b: str, metric: str, tolerance: float, as_json: bool) -> None:
    """Show what changed between two runs; exit 1 if an accuracy row did."""
    from phongbench.analysis.compare import compare as compare_runs
    from phongbench.analysis.compare_times import compare_times
    from phongbench.cli.layout import table
    from phongbench.results import runs as results

    pair = results.find(run_a, ROOT), results.find(run_b, ROOT)
    found = compare_runs(*pair, metric=metric, tolerance=tolerance)
    document = {**found.as_dict(), "times": compare_times(*pair)}
    summed = {name: document[name] for name in ("metric", "equal", "changed", "only_a", "only_b")}
    largest = [_changed(row) for row in document["rows"][:20]]
    show(
        document,
        as_json,
        lambda: facts(summed),
        lambda: table("Largest changes", *grid(largest)) if largest else None,
        lambda: _times(document["times"]),
    )
    if not found.same:
        sys.exit(DIFFERENT)


def _changed(row: dict[str, Any]) -> dict[str, Any]:
    """A changed row as people read it: its formula by one name, and nothing for what goes without saying."""
    from phongbench.formulas.formula import Formula

    said = ("precision", "alpha", "stratum", "perturbation", "length_error", "truth", "coverage")
    known = {name: None if row.get(name) in ("none", 0.0) else row.get(name) for name in said}
    return {"formula": str(Formula.of_row(row)), **known, **{n: row[n] for n in ("before", "after", "change")}}


def _times(times: dict[str, Any]) -> None:
    """The kernels whose times changed, or why none are compared."""
    from phongbench.cli.answer_tables import interval
    from phongbench.cli.layout import table

    if times["why_not"]:
        say(f"times are not compared: {times['why_not']}")
        return
    changed = [row for row in times["rows"] if row["verdict"] != "unresolved"]
    rows = [
        (r["name"], r["precision"], r["working_set"], r["before"], r["after"], r["ratio"], interval(r), r["verdict"])
        for r in changed[:20]
    ]
    columns = ("formula", "precision", "in", "before", "after", "after / before", "98 % interval", "verdict")
    if rows:
        table("Times over exact Phong's in the same run", columns, rows, right=columns[3:7])
    say(
        f"times: {len(changed)} of {len(times['rows'])} kernels changed beyond their 98 % intervals; "
        f"up to {0.02 * len(times['rows']):.0f} may by chance"
    )
