"""The machines that a formula may run on."""

import click

from phongbench.cli.common import JSON, show


@click.command(short_help="The machines that costs are known of.")
@JSON
def targets(as_json: bool) -> None:
    """List the targets: this machine's processor, which is timed, and chips whose compilers say what code costs there.

    Costs of the formulas that ship are shipped too. To compile your own for a target, its compiler must be here.

    \b
    Examples:
      phongbench targets
      phongbench targets --json
    """
    from phongbench.cli.terminal import table
    from phongbench.targets.listing import listing

    known = listing()
    columns = ("name", "title", "cost_kind", "unit", "rows", "tool_version")
    lines = [[*(one[c] for c in columns), _state(one)] for one in known]
    show({"targets": known}, as_json, lambda: table("", (*columns, "state"), lines, right=("rows",)))


def _state(one: dict[str, object]) -> str:
    if not one["available"]:
        return f"absent: {one['why_not']}"
    return "own formulas: " + str(one["needs"]) if one["needs"] else "ready"
