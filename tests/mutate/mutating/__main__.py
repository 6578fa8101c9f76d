"""`PYTHONPATH=tests/mutate python -m mutating`: exits 1 while a change survives that nobody has judged."""

import importlib
import importlib.util
import json
import math
import sys
import time
import tomllib
from pathlib import Path

import click
from mutating.changes import ROOMS, drawn
from mutating.trials import Bench

CHECKOUT = Path(__file__).resolve().parents[3]
#: survivors that someone has looked at: the change's name -> "equivalent: ..." or "cosmetic: ..."
JUDGED = Path(__file__).parents[1] / "judged.toml"
#: what tests import that knows nothing of us: loaded once, every session is a fork
_LOADED = ("hypothesis", "mpmath", "pandas", "pyarrow.parquet", "pytest", "scipy.special", "scipy.optimize", "rich")


@click.command()
@click.option("--count", type=click.IntRange(min=0), default=200, show_default=True)
@click.option("--minutes", default=math.inf, help="Begin nothing after so many.  [default: no end]")
@click.option("--seed", default=1, show_default=True, help="Equal seeds change the same.")
@click.option("--rooms", default=",".join(ROOMS), show_default=True, help="Where to change something.")
@click.option("--state", type=click.Path(path_type=Path), default=Path("phongbench-mutate"), show_default=True)
@click.option("--again", is_flag=True, help="Try those again that survived.")
@click.option("--docs", is_flag=True, help="Write the tables into the guide, too.")
def main(count: int, minutes: float, seed: int, rooms: str, state: Path, again: bool, docs: bool) -> None:
    """Single changes of the product, each against the tests that run it; prints one JSON document.

    A second call goes on where the first one stopped. What calls with another seed or count have tried counts, too.
    """
    _load()
    end = time.monotonic() + 60 * minutes
    bench = Bench(CHECKOUT, state.resolve(), _say)
    changes = drawn(bench.copy, rooms.split(","), seed)
    results, tried = bench.results(changes, again), bench.ever()
    sample = changes[:count] + [change for change in changes[count:] if change.name in tried]
    for number, change in enumerate(sample, 1):
        if change.name not in results and time.monotonic() < end:
            bench.keep(results, change.name, found := bench.tried(change))
            _say(f"{number}: {found['end']:<11} {found['seconds']:5.1f} s  {change.name}  {found['note']}")
    from mutating import tables  # after the last fork: it loads the product

    judged = tomllib.loads(JUDGED.read_text())
    seen = tables.Seen(len(changes), [results[c.name] for c in sample if c.name in results], judged)
    if docs:
        seen.write(CHECKOUT)
    click.echo(json.dumps(seen.as_dict(), indent=2))
    sys.exit(bool(seen.unjudged))


def _load() -> None:
    """Import what tests need, numba as the product does it: told first which vectors to use."""
    for name in _LOADED:
        importlib.import_module(name)
    spec = importlib.util.spec_from_file_location("late_numba", CHECKOUT / "phongbench" / "compiler" / "late_numba.py")
    assert spec is not None
    assert spec.loader is not None
    late_numba = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(late_numba)
    late_numba.load()


def _say(text: str) -> None:
    click.echo(text, err=True)


if __name__ == "__main__":
    main()
