"""Studies on many machines without a scheduler of ours: a shard of the sweep on each, and `merge`, which joins them."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, WITH, facts, say, show
from phongbench.cli.study_answers import SOME_CELLS_FAILED, build_report, exit_on_failures, summary
from phongbench.errors import InputError

#: the option of commands whose rows must be those of other machines
CPU_NAME = click.option(
    "--cpu-name", metavar="NAME", help="Compile for this processor, e.g. haswell: equal rows on unequal machines."
)


def pin_processor(name: str | None) -> None:
    """Compile for the processor of this name, if one is given; must come before anything is compiled."""
    if name is not None:
        from phongbench.support.processor import pin

        pin(name)


def cluster_engine(address: str | None, shard: str | None, files: Sequence[Path]) -> Any:
    """What measures a sweep on the cluster at an address; None without one."""
    if address is None:
        return None
    if shard:
        raise InputError("a shard is measured by one machine", "--cluster", "leave out --shard or --cluster")
    from phongbench.study.cluster.engine import Cluster

    return Cluster(address, files)


def shard_in(folder: Path) -> str | None:
    """The shard that a folder holds, if it holds one."""
    from phongbench.results import runs

    return runs.load(folder).shard


def measure_shard(
    plan: Any, shard: str, out: Path | None, files: Sequence[Path], given: dict[str, Any], as_json: bool
) -> None:
    """Measure a shard of a plan, and say how to go on.

    given  further arguments of `run_shard`
    """
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.study.shard_run import run_shard
    from phongbench.study.shards import ShardName

    name = ShardName.parsed(shard)
    with TerminalProgress(quiet=as_json) as progress:
        outcome = run_shard(plan, name, out, own=files, progress=progress, **given)

    def told() -> None:
        if outcome.finished_before:
            say("the shard was finished before: nothing is left to measure")
        facts({"shard": str(name), "blocks": outcome.blocks, "run": str(outcome.run.path)})
        say("when all are there: phongbench merge FOLDER .. --out RUN")

    show(outcome.as_dict(), as_json, told)
    for message, count in outcome.failures.items():
        say(f"{count} cells failed: {message}", err=True)
    if outcome.failures:
        sys.exit(SOME_CELLS_FAILED)


@click.command(short_help="Join the shards of a study.")
@click.argument("folders", nargs=-1, required=True, type=PATH, metavar="FOLDER..")
@click.option("--out", required=True, type=PATH, help="Folder of the run.")
@WITH
@click.option("--no-report", is_flag=True, help="Do not draw the report.")
@click.option("--jobs", type=click.IntRange(min=1), help="Threads of the probes.  [default: all cores]")
@CPU_NAME
@click.option("--fresh", is_flag=True, help="Discard the run that --out holds.")
@JSON
def merge(
    folders: tuple[Path, ...],
    out: Path,
    files: tuple[Path, ...],
    no_report: bool,
    jobs: int | None,
    cpu_name: str | None,
    fresh: bool,
    as_json: bool,
) -> None:
    """Join the shards that `phongbench run --shard I/N` measured: the rows of one machine, bit for bit.

    What follows the sweep is done here: probes, timing, report.

    \b
    Examples:
      phongbench run --preset standard --shard 1/2 --out a      (on one machine)
      phongbench run --preset standard --shard 2/2 --out b      (on another)
      phongbench merge a b --out study
    """
    pin_processor(cpu_name)
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.formulas.user_files import registry_with
    from phongbench.study.merge import merge as join

    given: dict[str, Any] = {"registry": registry_with(files), "own": files, "jobs": jobs, "fresh": fresh}
    with TerminalProgress(quiet=as_json) as progress:
        drawn = None if no_report else build_report
        command = ("phongbench", *sys.argv[1:])
        outcome = join(folders, out, build_report=drawn, progress=progress, command=command, **given)
    show(outcome.as_dict(), as_json, lambda: summary(outcome))
    exit_on_failures(outcome)
