"""The command that measures phongbench: beside other tools, beside its bounds, and beside itself of another day."""

import sys
from pathlib import Path

import click

from phongbench.cli.common import JSON, PATH, CommaList, say, show
from phongbench.errors import InputError


@click.command(short_help="Time our kernels against NumPy, numexpr, JAX, PyTorch, Taichi and C.")
@click.option("--peers", "names", type=CommaList("names"), help="numpy,numexpr,jax,torch,taichi,c  [default: all]")
@click.option("--budget", type=float, default=10.0, show_default=True, metavar="SECONDS", help="For the rounds.")
@click.option(
    "--studies",
    type=click.IntRange(0, 1000),
    default=1,
    show_default=True,
    help="Quick studies whose stages are timed, after one that warms up; 8 give intervals.",
)
@click.option(
    "--out", type=PATH, metavar="FILE.json", help="The ledger.  [default: phongbench-runs/ledgers/<time>-<digest>.json]"
)
@JSON
def bench(names: tuple[str, ...] | None, budget: float, studies: int, out: Path | None, as_json: bool) -> None:
    """Time the same work, exact Phong and Lyon gamma 8 in float32, by our kernels and by every installed peer.

    Beside loops written by hand in C, compiled here, a Gaussian and Lyon's cross form are timed too.

    All run interleaved on one thread over the same vectors, one Python call a pass, and their results are checked.
    Peers that are not installed are said to be absent; the extra `peers` brings them. The sweep's throughput against
    plain NumPy is measured too. Beside the time of our loops stands the least that their code can take on this machine,
    by its multiply-adds, its vector operations and its bytes; so it does beside shading and pictures of the shipped
    scenes. Then come the stages of the quick study.

    All is kept in a ledger, and `phongbench compare` tells what moved between two of them.

    \b
    Examples:
      phongbench bench
      phongbench bench --peers numpy,c --studies 8 --out before.json
      phongbench compare before.json after.json
    """
    if out is not None and out.suffix.lower() != ".json":
        raise InputError("a ledger is a JSON file", str(out), f"name it {out.stem}.json")
    from phongbench.benchmarks import ledger
    from phongbench.cli.bench_tables import bench_tables
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.results import ledgers
    from phongbench.support.user_paths import check_file

    if out is not None:
        check_file(out)
    with TerminalProgress(quiet=as_json) as progress:
        answer = ledger.measure(names, budget_seconds=budget, studies=studies, progress=progress)
    path = ledgers.write(ledgers.of_now(ledger.entries(answer), 1, ("phongbench", *sys.argv[1:])), out)
    show({**answer, "ledger": str(path)}, as_json, lambda: bench_tables(answer), lambda: say(f"ledger: {path}"))
