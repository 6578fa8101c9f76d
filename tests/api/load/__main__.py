"""`make bench-api`, or `PYTHONPATH=tests/api python -m load`: measures a server on loopback, prints tables."""

import json
from pathlib import Path
from typing import Any

import click

from load import overload, paired
from load.running import server
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.timing.statistics import LEVEL_TEXT, MIN_ROUNDS


@click.command()
@click.option(
    "--runs", type=click.Path(path_type=Path), default=DEFAULT_ROOT, show_default=True, help="Folder of the runs."
)
@click.option(
    "--rounds", type=click.IntRange(MIN_ROUNDS, 1000), default=40, show_default=True, help="Of large requests."
)
@click.option("--seconds", type=click.FloatRange(3, 600), default=12.0, show_default=True, help="Of overload.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def main(runs: Path, rounds: int, seconds: float, as_json: bool) -> None:
    """Measure the service over loopback, by itself on this machine: let nothing else run meanwhile."""
    found = measure(runs, rounds, seconds)
    click.echo(json.dumps(found, indent=2, allow_nan=False) if as_json else markdown(found))


def measure(runs: Path, rounds: int, seconds: float) -> dict[str, Any]:
    """Everything that is measured, as plain data."""
    with server(runs) as port:
        return {
            "paired": [*paired.moving(port, rounds), *paired.latency(port, 25 * rounds)],
            "overload": overload.overload(port, seconds),
        }


def markdown(found: dict[str, Any]) -> str:
    """The same as two tables in Markdown."""
    o = found["overload"]
    lines = [f"| request / compared with | ms | ms | ratio | {LEVEL_TEXT} | rounds |", "|---|---|---|---|---|---|"]
    lines += [
        f"| {r['what']} | {r['ms']:.3g} | {r['base_ms']:.3g} | {r['ratio']:.2f} "
        f"| {r['ratio_low']:.2f} to {r['ratio_high']:.2f} | {r['rounds']} |"
        for r in found["paired"]
    ]
    work = f"{overload.POINTS:,} points under {overload.LIGHTS} lights as multipart"
    lines += [
        "",
        f"| POST /v1/shade, {work} | |",
        "|---|---|",
        f"| capacity, clients that wait | {o['capacity_per_s']:.0f} requests/s |",
        f"| sent at {o['share']:.0%} of it | {o['requests']} requests, {o['left_out']} left out by the client |",
        f"| refused with 503 | {o['refused']:.1%}; {_spread(o, 'refused')} |",
        f"| any other failure | {abs(o['other'] + o['broken']):.1%} |",
        f"| admitted | {_spread(o, 'admitted')} |",
        f"| last third / middle third of admitted | {_number(o['flat'])} |",
        f"| for comparison, at half the capacity | {_spread(o, 'half')} |",
        f"| GET /healthz meanwhile | {_spread(o, 'health')}; {o['health_failed']:.1%} failed |",
    ]
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f}"


def _spread(o: dict[str, Any], name: str) -> str:
    median, last = o[f"{name}_p50_ms"], o[f"{name}_p99_ms"]
    return "none" if median is None else f"median {median:.1f} ms, 99 % {last:.1f} ms"


if __name__ == "__main__":
    main()
