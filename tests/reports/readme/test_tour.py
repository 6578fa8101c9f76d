"""The notebook of the tour is what the program writes: its cells run, and show what is stored."""

import json
from pathlib import Path
from typing import Any

import pytest

from phongbench_reports.readme import tour

NOTEBOOK = Path(__file__).resolve().parents[3] / "reports" / "docs" / "tour.ipynb"


def told(outputs: list[dict[str, Any]]) -> list[Any]:
    """What a reader sees: pictures by their kind, since they hold the version of what drew them."""
    lines: list[Any] = []
    for one in outputs:
        data = one.get("data", {})
        lines.append(
            [
                sorted(data),
                "".join(one.get("text", [])),
                *("".join(data.get(f"text/{k}", [])) for k in ("html", "plain")),
            ]
        )
    return lines


@pytest.fixture(scope="module")
def stored() -> Any:
    return json.loads(NOTEBOOK.read_text(encoding="utf-8"))


def test_the_notebook_holds_the_cells_of_its_text_in_format_4_5(stored: Any) -> None:
    assert (stored["nbformat"], stored["nbformat_minor"]) == (4, 5)
    assert [(cell["cell_type"], "".join(cell["source"])) for cell in stored["cells"]] == tour.cells()
    assert len({cell["id"] for cell in stored["cells"]}) == len(stored["cells"])


def test_every_cell_runs_and_shows_what_is_stored(stored: Any, tmp_path: Path) -> None:
    before = Path.cwd()
    outputs = tour.executed(tmp_path)
    assert Path.cwd() == before
    kept = [cell["outputs"] for cell in stored["cells"] if cell["cell_type"] == "code"]
    assert [told(one) for one in outputs] == [told(one) for one in kept]
    assert json.loads(tour.notebook(outputs)).keys() == stored.keys()
    assert any("image/png" in one.get("data", {}) for cell in outputs for one in cell)


def test_the_notebook_names_no_place_of_the_machine_and_no_time(stored: Any) -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    for word in (str(Path.home()), "/tmp", "/work", "seconds", " ns"):
        assert word not in text


def test_a_cell_that_fails_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tour, "cells", lambda: [("code", "1 / 0")])
    with pytest.raises(ZeroDivisionError):
        tour.executed(tmp_path)
