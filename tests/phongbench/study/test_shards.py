"""Shards of a sweep: cut alike everywhere, measured apart, joined to the rows of one machine."""

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from phongbench.accuracy import sweep
from phongbench.cli.main import main
from phongbench.errors import CorruptRunError, InputError, InterruptedStudyError
from phongbench.inputs.plan import Plan
from phongbench.results import arithmetic, checkpoints, runs
from phongbench.study import run as study
from phongbench.study import shards
from phongbench.study.merge import joinable, merge
from phongbench.study.shard_run import run_shard
from phongbench.study.shards import ShardName
from phongbench.support.progress import Progress

#: a slab this small gives the plan batches of many blocks, so that shards share some
SLAB = 1024
COUNT = 3


@pytest.fixture(scope="module")
def plan(tiny: Callable[..., Plan]) -> Plan:
    return tiny(alphas=(10.0, 50.0), lambda_forms=("dot", "cross"), probes=("hostile",), samples=4000)


@pytest.fixture(scope="module", autouse=True)
def small_slabs() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "SLAB", SLAB)
        patch.setattr(shards, "SLAB", SLAB)
        yield


@pytest.fixture(scope="module")
def whole(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The run of one machine."""
    return study.run_study(plan, tmp_path_factory.mktemp("whole") / "run").run


@pytest.fixture(scope="module")
def measured(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the shards, named 1, 2, 3."""
    root = tmp_path_factory.mktemp("shards")
    for index in range(1, COUNT + 1):
        run_shard(plan, ShardName(index, COUNT), root / str(index))
    return root


@pytest.fixture
def copies(measured: Path, tmp_path: Path) -> list[Path]:
    """Shards that a test may change."""
    shutil.copytree(measured, tmp_path / "copies")
    return [tmp_path / "copies" / str(index) for index in range(1, COUNT + 1)]


@pytest.mark.parametrize("count", [1, 2, 3, 7, 30])
def test_shards_are_the_sweep_cut_in_pieces_of_like_cost(plan: Plan, count: int) -> None:
    prepared = sweep.prepare(plan)
    pieces = shards.cut(prepared.batches, count)
    everything = [(batch, start) for batch in prepared.batches for start in sweep.slabs(batch)]
    assert [block for piece in pieces for block in piece] == everything
    assert len(pieces) == count
    assert all(pieces)
    costs = [sum(shards.cost(*block) for block in piece) for piece in pieces]
    largest = max(shards.cost(*block) for block in everything)
    assert max(costs) <= sum(costs) / count + largest


def test_as_many_shards_as_blocks_have_one_each_and_more_are_refused(plan: Plan) -> None:
    prepared = sweep.prepare(plan)
    blocks = sum(len(sweep.slabs(batch)) for batch in prepared.batches)
    assert [len(piece) for piece in shards.cut(prepared.batches, blocks)] == [1] * blocks
    with pytest.raises(InputError, match="more than the plan has blocks"):
        shards.cut(prepared.batches, blocks + 1)


@pytest.mark.parametrize("text", ["", "0/3", "4/3", "1", "1/0", "-1/3", "1/3/5", "a/b", "1.0/3", "١/3"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is no shard"):
        ShardName.parsed(text)


def test_shards_joined_in_any_order_give_the_rows_of_one_machine(
    plan: Plan, whole: runs.Run, measured: Path, tmp_path: Path
) -> None:
    shared = [len(checkpoints.block_files(measured / str(index))) for index in range(1, COUNT + 1)]
    assert all(shared), "no batch is shared, so the test shows nothing"
    joined = merge([measured / name for name in ("3", "1", "2")], tmp_path / "joined").run
    assert joined.complete
    assert runs.verify(joined) == []
    for table in ("accuracy", "worst", "behaviour"):
        pd.testing.assert_frame_equal(getattr(joined, table), getattr(whole, table), check_exact=True)
    assert [shard["index"] for shard in joined.manifest["merged"]] == [1, 2, 3]


def test_sums_of_blocks_depend_on_their_order(plan: Plan) -> None:
    """Why blocks are kept one by one: another order of merging gives other bits."""
    prepared = sweep.prepare(plan)
    chosen = [(batch, start) for batch in prepared.batches for start in sweep.slabs(batch) if batch.index == 0]
    blocks = [block.errors for _, block in sweep.blocks(prepared, chosen)]
    tails = [block.errors for _, block in sweep.blocks(prepared, chosen)]
    for later in blocks[1:]:
        blocks[0].merge(later)
    for later in tails[2:]:
        tails[1].merge(later)
    tails[0].merge(tails[1])
    np.testing.assert_allclose(tails[0].sums, blocks[0].sums)
    assert (tails[0].sums != blocks[0].sums).any()


class Stop(Progress):
    """Interrupts after some blocks."""

    def __init__(self, after: int) -> None:
        self.left = after

    def advance(self, steps: float = 1) -> None:
        self.left -= steps > 1
        if self.left <= 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize("after", [1, 3, 9])
def test_an_interrupted_shard_goes_on(plan: Plan, measured: Path, tmp_path: Path, after: int) -> None:
    out, name = tmp_path / "2", ShardName(2, COUNT)
    with pytest.raises(InterruptedStudyError):
        run_shard(plan, name, out, progress=Stop(after))
    with pytest.raises(InputError, match="is not finished"):
        joinable([out])
    run_shard(plan, name, out, resume=True)
    again = run_shard(plan, name, out, resume=True)
    assert again.finished_before
    joinable([measured / "1", out, measured / "3"])
    key = ["batch", "cell", "truth"]
    left, right = (
        pd.concat(checkpoints.read_parts(folder)).sort_values(key, ignore_index=True)
        for folder in (out, measured / "2")
    )
    pd.testing.assert_frame_equal(left, right, check_exact=True)


def _told(folder: Path, change: Callable[[dict[str, object]], None]) -> None:
    manifest = json.loads((folder / "manifest.json").read_text())
    change(manifest)
    (folder / "manifest.json").write_text(json.dumps(manifest))


def _set(*path: str, value: object) -> Callable[[dict[str, object]], None]:
    def change(manifest: dict[str, object]) -> None:
        place: object = manifest
        for key in path[:-1]:
            place = place[key]  # type: ignore[index]
        place[path[-1]] = value  # type: ignore[index]

    return change


OTHERS = {
    "numba": (_set("shard", "arithmetic", "numba", value="0.1"), "numba 0.1 instead of"),
    "code": (_set("shard", "arithmetic", "code", value="f" * 16), "code ffffffffffffffff instead of"),
    "processor": (_set("shard", "arithmetic", "features", value="mmx"), "features of the processor without"),
    "own": (_set("shard", "arithmetic", "own formulas", value="abc"), "own formulas abc"),
    "seed": (_set("plan", "seed", value=2), "another plan"),
    "count": (_set("shard", "count", value=4), "shard 2/4"),
    "failures": (_set("shard", "failures", value={"no": 1}), "other cells failed"),
    "twice": (_set("shard", "index", value=1), "is given twice"),
}


@pytest.mark.parametrize("case", OTHERS)
def test_what_does_not_belong_together_is_refused_by_name(copies: list[Path], case: str) -> None:
    change, message = OTHERS[case]
    _told(copies[1], change)
    with pytest.raises(InputError, match=message) as caught:
        joinable(copies)
    assert str(copies[1]) in str(caught.value)


def test_other_arithmetic_than_here_is_refused(copies: list[Path]) -> None:
    for folder in copies:
        _told(folder, _set("shard", "arithmetic", "numba", value="0.1"))
    with pytest.raises(InputError, match="than this machine: here numba"):
        joinable(copies)


def test_missing_shards_are_named(copies: list[Path]) -> None:
    with pytest.raises(InputError, match="2 of 3 shards are missing: 1, 3"):
        joinable(copies[1:2])


def test_damaged_shards_are_refused(copies: list[Path]) -> None:
    file = next(iter(checkpoints.block_files(copies[0]).values()))
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    with pytest.raises(CorruptRunError, match="has other bytes"):
        joinable(copies)
    file.unlink()
    with pytest.raises(CorruptRunError, match="is missing"):
        joinable(copies)


def test_a_merge_does_not_overwrite_a_run_and_clears_what_an_interrupted_one_left(
    whole: runs.Run, copies: list[Path], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="already holds a run"):
        merge(copies, whole.path)
    left = tmp_path / "left"
    shutil.copytree(copies[0] / "parts", left / "parts")
    joined = merge(copies, left).run
    pd.testing.assert_frame_equal(joined.accuracy, whole.accuracy, check_exact=True)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["merge", "1", "2", "--out", "joined"], 2, "1 of 3 shards are missing: 3"),
        (["merge", "nothing", "--out", "joined"], 2, "is not a run"),
        (["merge", "--out", "joined"], 2, "Missing argument"),
        (["merge", "1", "2", "3"], 2, "--out"),
        (["run", "--shard", "4/3"], 2, "is no shard"),
        (["run", "--resume", "--shard", "2/3", "--out", "1"], 2, "holds shard 1/3"),
        (["report", "1"], 2, "shard 1/3"),
        (["front", "1", "--alpha", "10"], 2, "phongbench merge"),
        (["run", "--resume", "--out", "1"], 0, ""),
    ],
)
def test_commands_on_shards(
    copies: list[Path], monkeypatch: pytest.MonkeyPatch, words: list[str], code: int, message: str
) -> None:
    monkeypatch.chdir(copies[0].parent)
    found = CliRunner().invoke(main, words)
    assert (found.exit_code, found.exception is None or isinstance(found.exception, SystemExit)) == (code, True)
    assert message in found.stderr


def test_show_says_which_shard_it_is(measured: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(measured)
    facts = json.loads(CliRunner().invoke(main, ["show", "1", "--json"]).stdout)["facts"]
    assert facts["state"] == "partial"
    assert "shard 1/3" in facts["note"]
    assert "phongbench merge" in facts["note"]


def test_arithmetic_is_told_by_what_differs() -> None:
    here = arithmetic.arithmetic()
    assert arithmetic.difference(here, dict(here)) is None
    assert arithmetic.difference({"a": "1"}, {"a": "1", "b": "2"}) == "b 2 instead of unknown"
    many = {"features": " ".join(map(str, range(20)))}
    assert arithmetic.difference({"features": "0"}, many).endswith("and 13 more")  # type: ignore[union-attr]
