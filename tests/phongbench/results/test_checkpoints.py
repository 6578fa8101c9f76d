"""What a study has finished lies whole in files, and what cannot be read back is told with its file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from phongbench.errors import CorruptRunError
from phongbench.results import checkpoints

FRAME = pd.DataFrame({"alpha": [5.0, 10.0], "name": ["a", "b"]})


def test_parts_are_read_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    assert checkpoints.read_parts(tmp_path) == []
    for number in (10, 2):
        checkpoints.append_part(tmp_path, number, FRAME.assign(part=number))
    assert [frame["part"].tolist() for frame in checkpoints.read_parts(tmp_path)] == [[2, 2], [10, 10]]


def test_a_probe_is_read_back_with_all_its_tables_and_facts(tmp_path: Path) -> None:
    assert checkpoints.read_probe(tmp_path, "search") is None
    tables = {"worst": FRAME, "accuracy": FRAME.assign(alpha=1.0)}
    checkpoints.write_probe(tmp_path, "search", tables, {"seconds": 1.5})
    found = checkpoints.read_probe(tmp_path, "search")
    assert found is not None
    assert found[1] == {"seconds": 1.5}
    assert found[0].keys() == tables.keys()
    for name, frame in tables.items():
        pd.testing.assert_frame_equal(found[0][name], frame)
    assert checkpoints.read_probe(tmp_path, "certify") is None
    assert checkpoints.read_parts(tmp_path) == []  # no parts of the sweep


def test_blocks_are_found_by_batch_and_start_and_hold_every_bit(tmp_path: Path) -> None:
    array = np.array([np.nan, -0.0, 5e-324])
    for batch, start in ((12345678, 0), (1, 1 << 41), (1, 0)):
        checkpoints.write_block(tmp_path, batch, start, {"sums": array})
    files = checkpoints.block_files(tmp_path)
    assert list(files) == [(1, 0), (1, 1 << 41), (12345678, 0)]
    assert checkpoints.read_block(files[1, 1 << 41])["sums"].tobytes() == array.tobytes()


def test_what_cannot_be_read_is_told_with_its_file(tmp_path: Path) -> None:
    checkpoints.append_part(tmp_path, 1, FRAME)
    checkpoints.write_probe(tmp_path, "search", {"worst": FRAME}, {})
    checkpoints.write_block(tmp_path, 1, 0, {"sums": np.zeros(3)})
    whole = checkpoints.digests(tmp_path)
    assert len(whole) == 4
    for file in (tmp_path / checkpoints.PARTS).iterdir():
        file.write_bytes(file.read_bytes()[:-3])
    assert set(checkpoints.digests(tmp_path).items()).isdisjoint(whole.items())
    (block,) = checkpoints.block_files(tmp_path).values()
    with pytest.raises(CorruptRunError, match=r"000001\.parquet"):
        checkpoints.read_parts(tmp_path)
    with pytest.raises(CorruptRunError, match=r"search\.json"):
        checkpoints.read_probe(tmp_path, "search")
    with pytest.raises(CorruptRunError, match="block-"):
        checkpoints.read_block(block)
