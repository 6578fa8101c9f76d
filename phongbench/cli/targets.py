"""The machines that a formula may run on."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, ROOT, show


@click.group(invoke_without_command=True, short_help="The machines that costs are known of.")
@JSON
@click.pass_context
def targets(context: click.Context, as_json: bool) -> None:
    """List the targets: this machine's processor, which is timed, and chips whose compilers say what code costs there.

    Costs of the formulas that ship are shipped too. To compile your own for a target, its compiler must be here. GPUs
    that were measured elsewhere are listed once they are added.

    \b
    Examples:
      phongbench targets
      phongbench targets --json
      phongbench targets add page-adreno-740.json
    """
    if context.invoked_subcommand is not None:
        return
    from phongbench.cli.layout import table
    from phongbench.targets.listing import listing

    known = listing(ROOT)
    columns = ("name", "title", "cost_kind", "unit", "rows", "tool_version")
    lines = [[*({**one, "rows": _rows(one)}[c] for c in columns), _state(one)] for one in known]
    show({"targets": known}, as_json, lambda: table("", (*columns, "state"), lines, right=("rows",)))


@targets.command(short_help="Add a target that was measured elsewhere.")
@click.argument("file", type=PATH, metavar="FILE.json")
@JSON
def add(file: Path, as_json: bool) -> None:
    """Add a measurement of another machine, such as the explorer's of the GPU that a browser runs on.

    It is checked, kept among the runs as phongbench-runs/targets/NAME.json, and from then on a target like the others:
    `recommend --target NAME`. One of the same name is replaced.

    \b
    Example:
      phongbench targets add page-adreno-740.json
    """
    from phongbench.targets import measured

    table, place = measured.add(file, ROOT)
    told = {"target": table.name, "adapter": table.adapter, "rows": len(table.rows), "path": str(place)}
    line = f"{table.name}: {table.adapter}, {len(table.rows)} codes by {table.tool}; kept as {place}"
    show(told, as_json, lambda: click.echo(line))


def _rows(one: dict[str, Any]) -> object:
    """How many codes have a cost, those of shorter floats apart."""
    shorter = [f"{n} {precision}" for precision, n in (one["precisions"] or {}).items() if precision != "float32"]
    return " + ".join([str(one["rows"]), *shorter]) if shorter else one["rows"]


def _state(one: dict[str, object]) -> str:
    if not one["available"]:
        return f"absent: {one['why_not']}"
    return "own formulas: " + str(one["needs"]) if one["needs"] else "ready"
