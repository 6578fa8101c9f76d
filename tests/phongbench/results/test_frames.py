"""Tables as pandas has them: with text as strings or, where they are large, as categories; the rows are the same."""

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from phongbench.analysis.rows import Rows, at
from phongbench.results import frames
from phongbench.results.runs import Run

WORDS = pd.DataFrame({"word": pd.array(["b", None, "a", "b"], dtype="str"), "number": [1.0, 2.0, 3.0, 4.0]})


def test_errors_are_read_compactly_with_the_same_rows(stored: Callable[..., Run]) -> None:
    run = stored()
    pd.testing.assert_frame_equal(frames.plain(run.compact_accuracy), run.accuracy, check_exact=True)
    pd.testing.assert_frame_equal(run.accuracy, pd.read_parquet(run.path / "accuracy.parquet"), check_exact=True)
    memory = [rows.memory_usage(deep=True).sum() for rows in (run.compact_accuracy, run.accuracy)]
    assert memory[0] < 0.65 * memory[1]


def test_a_cut_of_compact_rows_is_that_of_strings(stored: Callable[..., Run]) -> None:
    rows = Rows(stored())
    assert isinstance(rows.accuracy["stratum"].dtype, pd.CategoricalDtype)
    wanted = {"stratum": ("highlight", "peak"), "truth": "angle"}
    pd.testing.assert_frame_equal(at(rows.accuracy, **wanted), at(frames.plain(rows.accuracy), **wanted))
    assert at(rows.accuracy, stratum="of no such name").empty


def test_categories_sort_as_their_strings_do() -> None:
    held = WORDS.assign(word=pd.Categorical(WORDS["word"], ["b", "a"]))
    ordered = frames.compacted(held).sort_values("word", kind="stable")
    assert ordered["number"].tolist() == [3.0, 1.0, 4.0, 2.0]


def test_what_is_compact_shares_its_numbers() -> None:
    small = frames.compacted(WORDS)
    assert np.shares_memory(small["number"].to_numpy(), WORDS["number"].to_numpy())
    pd.testing.assert_frame_equal(frames.plain(small), WORDS)


@pytest.mark.parametrize("count", [0, 1, 300])
def test_every_text_of_many_is_found(count: int) -> None:
    """Places of few texts take a byte, those of more do not fit."""
    names = [f"name {i:03}" for i in range(count)]
    records = frames.Records.of(pd.DataFrame({"name": pd.array([*names, *names], dtype="str")}))
    assert records.distinct("name") == names
    assert all(len(records.at(name=name)) == 2 for name in names[-2:])
