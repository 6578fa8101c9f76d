"""What a plan would take on more cores, on paper: laws of a forecast, whatever was measured."""

import json
from collections.abc import Callable

import pytest
from click.testing import CliRunner

from phongbench.accuracy import sweep
from phongbench.cli.main import main
from phongbench.inputs.plan import Plan
from phongbench.study import shards
from phongbench.study.forecast import SHARD_SECONDS, Trial

Tiny = Callable[..., Plan]


def trial(plan: Plan, work: float, longest: float) -> Trial:
    return Trial(sweep.prepare(plan), 0, work, longest)


def test_threads_and_cores_share_the_sweep_but_not_its_longest_block(tiny: Tiny) -> None:
    found = trial(tiny(samples=300_000), 1000.0, 20.0)
    assert found.on(1).seconds["accuracy"] == pytest.approx(1000, rel=0.01)
    assert found.on(4).seconds["accuracy"] == pytest.approx(250, rel=0.01)
    cores = (1, 8, 32, 512, 4096)
    swept = [found.on(2, count).seconds["accuracy"] for count in cores]
    assert swept == sorted(swept, reverse=True)
    assert swept[1] == pytest.approx(125, rel=0.01)
    assert min(swept) >= 20.0
    assert [found.on(2, count).limited_by for count in cores] == ["measuring"] * 3 + ["the longest block"] * 2


def test_where_nothing_is_left_to_measure_handing_out_is_what_takes_time(tiny: Tiny) -> None:
    plan = tiny(samples=3_000_000)
    found = trial(plan, 1e-3, 1e-6)
    told = found.on(1, 4096)
    assert told.limited_by == "handing out"
    blocks = sum(len(sweep.slabs(batch)) for batch in found.sweep.batches)
    assert told.seconds["accuracy"] == pytest.approx(SHARD_SECONDS * blocks, rel=0.1)


def test_probes_and_times_stay_on_the_client(tiny: Tiny) -> None:
    found = trial(tiny(probes=("hostile", "smoothness"), timing=True, timing_budget=1234.0), 1.0, 0.1)
    for stage in ("stability", "timing"):
        assert found.on(2, 4096).seconds[stage] == found.on(2).seconds[stage] > 0
    assert found.on(2, 4096).limited_by == "timing"


@pytest.mark.parametrize("samples", [1000, 3_000_000, 100_000_000])
def test_more_threads_get_more_shards_but_none_without_work(tiny: Tiny, samples: int) -> None:
    batches = sweep.prepare(tiny(samples=samples)).batches
    blocks = sum(len(sweep.slabs(batch)) for batch in batches)
    found = [shards.number(batches, threads) for threads in (1, 2, 16, 1000)]
    assert found == sorted(found)
    assert min(blocks, 1000) <= found[-1] <= min(blocks, shards.EACH * 1000)
    assert found[0] >= min(blocks, shards.EACH)
    assert found[0] <= max(shards.EACH, shards.LEAST)


def test_the_command_tells_it_and_wants_a_dry_run() -> None:
    few = "--alpha 10 --gamma 8 --only lyon --lambda dot --precision float32 --probe none --samples 500 --no-timing"
    found = CliRunner().invoke(main, ["run", *few.split(), "--dry-run", "--cores", "64", "--json"])
    assert found.exit_code == 0, found.output
    assert json.loads(found.stdout)["limited_by"] in ("handing out", "loading kernels", "the longest block")
    found = CliRunner().invoke(main, ["run", "--cores", "64"])
    assert (found.exit_code, "--dry-run" in found.stderr) == (2, True)
