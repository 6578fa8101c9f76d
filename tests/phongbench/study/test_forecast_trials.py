"""The forecast by its law, with made-up costs of pairs and cells: exact where these hold, and shards add up."""

from dataclasses import replace
from typing import Any

import pytest

from phongbench.accuracy import sweep
from phongbench.accuracy.batches import Batch
from phongbench.inputs.plan import Plan
from phongbench.study import forecast as module
from phongbench.study.forecast import forecast
from phongbench.study.shards import ShardName

BLOCK, PAIR, CELL, WIDE = 1e-3, 2e-8, 3e-9, 2.0
PLAN = Plan(
    approximations=("phong", "lyon", "gaussian"),
    alphas=(10.0, 50.0),
    gammas=(4, 8),
    precisions=("float32", "float64"),
    strata=("uniform", "cutoff", "lengths", "hostile"),
    samples=300_000,
    probes=(),
    raw=(),
    timing=False,
).validated()


@pytest.fixture(autouse=True)
def costs(monkeypatch: pytest.MonkeyPatch) -> list[Batch]:
    """Nothing is compiled or tried: what batches would take is made up. The batches that were tried."""
    tried: list[Batch] = []

    def took(_: Any, batch: Batch) -> float:
        assert 0 < batch.samples <= 4 * sweep.PIECE
        tried.append(batch)
        return law(batch)

    monkeypatch.setattr(sweep, "_clocked_block", took)
    monkeypatch.setattr(sweep, "compile_kernels", lambda *_: 0)
    monkeypatch.setattr(module, "ROW_SECONDS", 0.0)
    monkeypatch.setattr(module, "CELL_SECONDS", 0.0)
    return tried


def law(batch: Batch) -> float:
    """Seconds of a batch: of its blocks, and of its pairs with its cells; wide numbers take twice as long, and each
    second truth a cell more.
    """
    wide = WIDE if batch.precision.name == "float64" else 1.0
    cells = len(batch.cells) + batch.truths
    return wide * (BLOCK * cells * len(sweep.slabs(batch)) + batch.samples * (PAIR + CELL * cells))


def test_where_pairs_and_cells_cost_the_same_in_a_kind_the_forecast_is_exact(costs: list[Batch]) -> None:
    prepared = sweep.prepare(PLAN)
    assert forecast(PLAN, jobs=1).seconds["accuracy"] == pytest.approx(sum(map(law, prepared.batches)))
    assert len(costs) < 2 * len(prepared.batches)


def test_a_batch_is_tried_only_where_its_kind_is_wanted(costs: list[Batch]) -> None:
    forecast(PLAN, jobs=1, shard=ShardName(1, 40))
    assert {batch.precision.name for batch in costs} == {"float32"}


@pytest.mark.parametrize("count", [1, 3, 7])
def test_shards_add_up_to_the_whole(count: int) -> None:
    whole = forecast(PLAN, jobs=1)
    parts = [forecast(PLAN, jobs=1, shard=ShardName(i, count)) for i in range(1, count + 1)]
    assert sum(part.evaluations for part in parts) == whole.evaluations
    assert sum(part.seconds["accuracy"] for part in parts) == pytest.approx(whole.seconds["accuracy"])
    assert {tuple(part.seconds) for part in parts} == {("accuracy",)}
    assert {part.cells for part in parts} == {whole.cells}


def test_twice_the_cores_take_half_as_long_and_twice_the_samples_twice() -> None:
    one, two = (forecast(PLAN, jobs=jobs).seconds["accuracy"] for jobs in (1, 2))
    assert one == pytest.approx(2 * two)
    fixed = replace(PLAN, strata=("uniform",), samples=2 * sweep.SLAB).validated()
    more = replace(fixed, samples=2 * fixed.samples).validated()
    seconds = [forecast(plan, jobs=1).seconds["accuracy"] for plan in (fixed, more)]
    assert seconds[1] == pytest.approx(2 * seconds[0])
