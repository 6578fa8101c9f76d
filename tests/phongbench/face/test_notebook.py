"""What a notebook shows of a run: the answer by target, inert to what users write, and the front as a picture."""

import re
import sys
from typing import Any

import matplotlib as mpl
import pandas as pd
import pytest

import phongbench as pb
from phongbench.errors import InputError
from phongbench.face import notebook
from phongbench.results.records import Records

TINY = {"alphas": [10, 50], "gammas": [8], "approximations": ["lyon", "gaussian"], "precisions": ["float32"]}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("notebook") / "a<script>b"
    return pb.run(out=folder, samples=2000, timing=False, probes=[], **TINY)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def front(run: Any) -> Any:
    return run.front(alpha=10, target="cortex-m7")


def test_a_run_shows_its_answer_by_target(run: Any) -> None:
    html = run._repr_html_()
    head = re.findall(r"<th>([^<]*)</th>", html.split("<thead>")[1].split("</thead>")[0])
    assert head[0] == "alpha"
    assert "cortex-m7" in ", ".join(head)
    rows = [re.findall(r"<td>([^<]*)</td>", row) for row in html.split("</thead>")[1].split("</tr>") if "<td>" in row]
    assert [row[0] for row in rows] == ["10", "50"]
    assert all(re.fullmatch(r"[\w:-]+ [\d.]+|nothing fits", cell) for row in rows for cell in row[1:])


def test_names_of_users_are_inert(run: Any) -> None:
    (run.path / "report").mkdir()
    (run.path / "report" / "index.html").touch()
    html = run._repr_html_()
    assert "<script" not in html
    assert 'href="' in html
    assert "%3Cscript%3E" in html


def test_a_run_without_float32_shows_its_most_accurate_formulas(run: Any) -> None:
    half = type(run)(run.path, run.manifest)
    half.__dict__["_records"] = {"accuracy": Records.of(run.accuracy.assign(precision="float16"))}
    assert notebook._answers(half) == ""


def test_a_front_is_a_table_that_draws_its_rows(front: Any) -> None:
    assert isinstance(front, pd.DataFrame)
    assert type(front.head()) is pd.DataFrame
    mpl.use("Agg")
    axes = front.plot()
    drawn = {(round(x, 9), round(y, 9)) for line in axes.lines for x, y in zip(*line.get_data(), strict=True)}
    for row in front.to_dict("records"):
        assert (round(max(row["error"], 1e-7), 9), round(row["ratio"], 9)) in drawn
    assert {"on", "off", "unresolved"} == set(axes.get_legend_handles_labels()[1])
    assert "alpha 10" in axes.get_title(loc="left")


def test_a_front_draws_on_axes_that_are_given(front: Any) -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    assert front.plot(axes) is axes


def test_the_front_of_no_exponent_is_that_nearest_to_fifty(run: Any) -> None:
    assert run.front(target="cortex-m7").attrs["alpha"] == "50"


def test_what_is_no_front_or_cannot_be_drawn_is_told(front: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no front"):
        notebook.Front(pd.DataFrame({"a": [1]})).plot()
    for name in [name for name in sys.modules if name.split(".")[0] == "phongbench_reports"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "phongbench_reports", None)
    with pytest.raises(InputError, match="not installed"):
        front.plot()
