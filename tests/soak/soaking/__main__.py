"""`PYTHONPATH=tests/soak python -m soaking`: exits 1 on any fault."""

import json
import math
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from soaking import campaigns, cluster_bars, cluster_kills, disk_tries, faulty_disk, tables
from soaking import gpu as gpus
from soaking import inverse as inverses
from soaking import page as pages

from phongbench.targets.webgpu.session import Session, found
from phongbench_reports.readme.fill import write

CHECKOUT = Path(__file__).resolve().parents[3]
DOCS = click.option("--docs", is_flag=True, help="Write the table into the guide, too.")
MINUTES = click.option("--minutes", default=math.inf, help="Begin nothing after so many.  [default: no end]")
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
        seen = inverses.soak(count, seed, Path(folder), bar.update)
    _tell(seen.as_dict(), seen.faults)


@main.command()
@click.option("--count", type=click.IntRange(min=1), help="So many, drawn by the seed.  [default: every one]")
@click.option("--in-turn", is_flag=True, help="At each call one of the faults, in turn.  [default: each of them]")
@MINUTES
@SEED
@DOCS
def disk(count: int | None, in_turn: bool, minutes: float, seed: int, docs: bool) -> None:
    """Each call to the disk fails, in each way: run, run --resume, merge, report, render leave nothing half-written."""
    extent = campaigns.Extent(count, minutes, seed)
    _inside("disk_faults" * docs, lambda bench: campaigns.every_fault(bench, in_turn, extent, _say))


@main.command()
@click.option("--count", type=click.IntRange(min=1), default=1000, show_default=True)
@MINUTES
@SEED
@DOCS
def kills(count: int, minutes: float, seed: int, docs: bool) -> None:
    """Kills at random moments: run, run --resume, merge and report go on to the same rows."""
    extent = campaigns.Extent(count, minutes, seed)
    _inside("kills" * docs, lambda bench: campaigns.random_kills(bench, extent, _say))


@main.command()
@click.option("--requests", "count", type=click.IntRange(min=10), default=1_000_000, show_default=True)
@MINUTES
@SEED
@DOCS
def service(count: int, minutes: float, seed: int, docs: bool) -> None:
    """Random and hostile requests to a service of two workers, by clients that stall, vanish and trickle."""
    from soaking import service as services  # what it sends lies in tests/api

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the service, too
    with tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder:
        found = services.soak(count, minutes, seed, Path(folder), _say)
    if docs:
        write(CHECKOUT, {"attacked": tables.of_service(found.as_dict())}, {})
    _tell(found.as_dict(), found.faults)


@main.command()
@click.option("--workers", type=click.IntRange(min=0), default=20, show_default=True)
@click.option("--clients", type=click.IntRange(min=0), default=20, show_default=True)
@click.option("--schedulers", type=click.IntRange(min=0), default=5, show_default=True)
@MINUTES
@SEED
@DOCS
def cluster(workers: int, clients: int, schedulers: int, minutes: float, seed: int, docs: bool) -> None:
    """Kills on a cluster at random moments of a sweep: of workers, clients and schedulers; the rows stay."""
    counts = {"worker": workers, "client": clients, "scheduler": schedulers}
    with tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder:
        done = cluster_kills.random_kills(Path(folder), counts, minutes, seed, _say)
    if docs:
        write(CHECKOUT, {"cluster_kills": tables.of_kills(done)}, {})
    _tell({name: one.as_dict() for name, one in done.items()}, [fault for one in done.values() for fault in one.faults])


@main.command()
@click.option("--preset", "preset_name", default="standard", show_default=True)
@click.option("--every", type=click.IntRange(min=1), default=14, show_default=True, help="One of so many exponents.")
@click.option("--rounds", type=click.IntRange(min=1), default=3, show_default=True)
def scaling(preset_name: str, every: int, rounds: int) -> None:
    """Two workers against one, and against threads: what a cluster's engine costs; let nothing else run."""
    with tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder:
        _tell(*cluster_bars.measured(Path(folder), preset_name, every, rounds, _say))


def _say(text: str) -> None:
    click.echo(text, err=True)


def _inside(part: str, tries: Callable[[disk_tries.Bench], dict[str, disk_tries.Tries]]) -> None:
    """Try in a process whose calls to the disk can fail; write the guide's part of this name, if there is one."""
    if not faulty_disk.is_preloaded():
        ended = faulty_disk.preloaded(sys.argv[1:])
        click.echo(ended.stdout, nl=False)
        sys.exit(ended.returncode)
    with tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder:
        done = tries(disk_tries.Bench(Path(folder)))
    if part:
        write(CHECKOUT, {part: tables.of_tries(done)}, {})
    _tell({name: one.as_dict() for name, one in done.items()}, [fault for one in done.values() for fault in one.faults])


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
        click.progressbar(length=runs + twins + 1, hidden=not sys.stderr.isatty(), file=sys.stderr) as bar,
    ):
        seen = gpus.soak(runs, twins, *gpus.here(session, adapter), bar.update)
    _tell(seen.as_dict(), seen.faults)


@main.command()
def page() -> None:
    """The page's measurement of its device, by WebGPU and by WebGL 2, against its bars; let nothing else run."""
    with tempfile.TemporaryDirectory(prefix="phongbench-soak-") as folder:
        seen = pages.measured(Path(folder))
    _tell(seen.as_dict(), seen.faults)


def _tell(data: dict[str, Any], faults: list[str]) -> None:
    click.echo(json.dumps(data, indent=2))
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
