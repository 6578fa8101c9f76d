"""`PYTHONPATH=tests/api python -m fuzzing --requests 100000`: exits 1 on any fault."""

import json
import sys
from pathlib import Path

import click

from fuzzing.run import fuzz
from phongbench.results.runs import DEFAULT_ROOT


@click.command()
@click.option("--requests", "count", type=click.IntRange(min=1), default=10_000, show_default=True)
@click.option("--seed", default=1, show_default=True, help="Equal seeds send equal requests.")
@click.option(
    "--runs", type=click.Path(path_type=Path), default=DEFAULT_ROOT, show_default=True, help="Folder of the runs."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def main(count: int, seed: int, runs: Path, as_json: bool) -> None:
    """Send hostile and random requests to the service, in this process: no 5xx, strict JSON, no echo, flat memory."""
    found = fuzz(count, seed, runs, progress=sys.stderr.isatty())
    told = found.as_dict()
    click.echo(
        json.dumps(told, indent=2) if as_json else "\n".join(f"{name:<16} {value}" for name, value in told.items())
    )
    sys.exit(bool(found.faults))


if __name__ == "__main__":
    main()
