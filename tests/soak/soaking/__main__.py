"""`PYTHONPATH=tests/soak python -m soaking`: exits 1 on any fault."""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import click
from soaking import gpu as gpus
from soaking import inverse as inverses

from phongbench.targets.webgpu.session import Session, found

SEED = click.option("--seed", default=1, show_default=True, help="Equal seeds try the same.")


@click.group()
def main() -> None:
    """Random input and faults, for minutes; each prints one JSON document."""


@main.command()
@click.option("--count", type=click.IntRange(min=1), default=100_000, show_default=True)
@SEED
def inverse(count: int, seed: int) -> None:
    """Random lines and pictures: none crashes, and what is refused names row, pixel or light."""
    with (
        tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder,
        click.progressbar(length=count, hidden=not sys.stderr.isatty(), file=sys.stderr) as bar,
    ):
        found = inverses.soak(count, seed, Path(folder), bar.update)
    _tell(found.as_dict(), found.faults)


@main.command()
@click.option("--runs", type=click.IntRange(min=1), default=10, show_default=True, help="Of the order of formulas.")
@click.option("--twins", type=click.IntRange(min=1), default=100, show_default=True, help="Exact Phong beside itself.")
def gpu(runs: int, twins: int) -> None:
    """The adapter of this machine against its bars; let nothing else run."""
    adapter, lacking = found()
    if adapter is None:
        raise click.ClickException(str(lacking))
    with (
        Session() as session,
        click.progressbar(length=runs + twins + 3, hidden=not sys.stderr.isatty(), file=sys.stderr) as bar,
    ):
        seen = gpus.soak(runs, twins, gpus.here(session, adapter), bar.update)
    _tell(seen.as_dict(), seen.faults)


def _tell(data: dict[str, Any], faults: list[str]) -> None:
    click.echo(json.dumps(data, indent=2))
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
