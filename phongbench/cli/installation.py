"""What this installation offers, and whether it and its machine are fit for a study."""

import sys
from pathlib import Path

import click

from phongbench.cli.common import DIFFERENT, JSON, WITH, CommaList, grid, show


@click.command(short_help="List the approximations.")
@WITH
@JSON
def approximations(files: tuple[Path, ...], as_json: bool) -> None:
    """List the approximations: formula, lambda forms, spaces, beta policies, source."""
    from phongbench.cli.layout import table
    from phongbench.formulas.registry import describe
    from phongbench.formulas.user_files import registry_with

    known = [describe(spec) for spec in registry_with(files).values()]
    columns = ("name", "kind", "formula", "lambda_forms", "spaces", "beta_policies")
    lines = [[", ".join(a[c]) if isinstance(a[c], list) else a[c] for c in columns] for a in known]
    show(known, as_json, lambda: table("", columns, lines))


@click.command(short_help="Check this installation and machine.")
@click.option("--timing", is_flag=True, help="Time identical code against itself, again and again, and count alarms.")
@click.option("--repeats", type=click.IntRange(min=10), default=200, show_default=True, help="How often, for --timing.")
@click.option(
    "--working-set", "working_sets", type=CommaList("names"), default="l1", show_default=True, help="Where, e.g. l1,l2."
)
@JSON
def doctor(timing: bool, repeats: int, working_sets: tuple[str, ...], as_json: bool) -> None:
    """Check what a study needs: compiler, kernel cache, vector width, disk, report packages.

    With --timing, check the timing instead: the share of false alarms on identical code must be at most 1 %.

    Exit 1 if something is missing, or the alarms are too many.
    """
    from phongbench.cli.layout import table

    if timing:
        from phongbench.benchmarks.false_alarms import count

        rows = [alarms.as_dict() for alarms in count(repeats, working_sets=working_sets)]
        show(rows, as_json, lambda: table("Identical code, timed against itself", *grid(rows)))
    else:
        from phongbench.study.doctor import examine

        checks = examine()
        rows = [{**c, "good": c["state"] != "bad"} for c in checks]
        lines = [(c["check"], c["state"], c["detail"]) for c in checks]
        show(checks, as_json, lambda: table("", ("check", "state", "detail"), lines))
    if not all(row["good"] for row in rows):
        sys.exit(DIFFERENT)
