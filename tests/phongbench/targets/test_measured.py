"""Targets that were measured elsewhere: what a file must hold, where it is kept, and what it answers."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from phongbench import __version__
from phongbench.cli.main import main
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.targets import measured
from phongbench.targets.code_shapes import code
from phongbench.targets.listing import listing

Document = dict[str, Any]


def row(formula: str, cost: float, alpha: float = 50.0) -> Document:
    return {"formula": formula, "alpha": alpha, "cost": cost, "low": 0.98 * cost, "high": 1.02 * cost}


@pytest.fixture
def document() -> Document:
    rows = [row("phong", 0.4), row("lyon:dot:8", 0.1), row("gaussian:dot", 0.2)]
    words = {"adapter": "Adreno (TM) 740", "tool": "WebGPU", "tool_version": "Chrome 142", "phongbench": __version__}
    head = {"schema": 1, "target": "page-adreno-740", "cost_kind": "measured", "unit": "ns", "precision": "float32"}
    return {**head, **words, "dot": {"cost": 0.05, "low": 0.049, "high": 0.051}, "rows": rows}


@pytest.fixture
def written(tmp_path: Path) -> Callable[[Any], Path]:
    """A file of this content."""

    def write(content: Any) -> Path:
        path = tmp_path / "download.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return path

    return write


def test_what_was_measured_is_kept_and_known_by_its_code(document: Document, written, tmp_path: Path) -> None:
    table, place = measured.add(written(document), tmp_path / "runs")
    assert place == tmp_path / "runs" / "targets" / "page-adreno-740.json"
    assert json.loads(place.read_text()) == document
    assert measured.names(tmp_path / "runs") == ["page-adreno-740"]
    assert measured.added("page-adreno-740", tmp_path / "runs") == table
    # other slopes and exponents run the same code, other forms and powers do not
    for spelling, alpha, cost in (("lyon:dot:8", 50, 0.1), ("lyon:dot:8:minimax", 77, 0.1), ("phong", 9.5, 0.4)):
        assert table.known(code(Formula.parse(spelling), alpha, "glsl")).cost == cost
    for spelling in ("lyon:cross:8", "lyon:dot:16", "lyon:dot:8/once"):
        assert table.known(code(Formula.parse(spelling), 50, "glsl")) is None
    assert table.ratios(table.baseline)[0] == 1
    lyon = table.known(code(Formula.parse("lyon:dot:8"), 50, "glsl"))
    assert table.ratios(lyon) == pytest.approx((0.25, 0.98 * 0.25, 1.02 * 0.25))


def test_measured_again_it_is_replaced(document: Document, written, tmp_path: Path) -> None:
    measured.add(written(document), tmp_path)
    document["rows"][1] = row("lyon:dot:8", 0.3)
    measured.add(written(document), tmp_path)
    assert measured.names(tmp_path) == ["page-adreno-740"]
    table = measured.added("page-adreno-740", tmp_path)
    assert table.known(code(Formula.parse("lyon:dot:8"), 50, "glsl")).cost == 0.3


WRONG: tuple[tuple[str, Callable[[Document], Any], str], ...] = (
    ("another schema", lambda d: d.update(schema=2), "schema 2"),
    ("no schema", lambda d: d.pop("schema"), "schema is missing"),
    ("a flag as schema", lambda d: d.update(schema=True), "whole number"),
    ("a name that leaves the folder", lambda d: d.update(target="page-../../x"), "page-adreno-740"),
    ("a name of ours", lambda d: d.update(target="rdna2"), "page-adreno-740"),
    ("counted, not measured", lambda d: d.update(cost_kind="compiled"), "cost_kind"),
    ("another unit", lambda d: d.update(unit="cycles"), "unit"),
    ("another precision", lambda d: d.update(precision="float16"), "precision"),
    ("an adapter of two lines", lambda d: d.update(adapter="a\nb"), "adapter"),
    ("an escape", lambda d: d.update(tool="\x1b[2J"), "tool"),
    ("no version", lambda d: d.pop("tool_version"), "tool_version is missing"),
    ("another version's code", lambda d: d.update(phongbench="0.0.1"), "another version of phongbench"),
    ("an unknown key", lambda d: d.update(colour="red"), "colour"),
    ("an unknown formula", lambda d: d["rows"].append(row("lion", 1.0)), "lion"),
    ("an exponent that it does not take", lambda d: d["rows"].append(row("integer-power", 1.0, 2.5)), "2.5"),
    ("the same twice", lambda d: d["rows"].append(row("lyon:dot:8", 0.2)), "twice"),
    ("a negative time", lambda d: d["rows"].append(row("schlick", -1.0)), "cost"),
    ("no time", lambda d: d["rows"].append(row("schlick", 0.0)), "cost"),
    ("an endless time", lambda d: d["rows"].append(row("schlick", math.inf)), "cost"),
    ("not a number", lambda d: d["rows"].append(row("schlick", math.nan)), "cost"),
    ("text", lambda d: d["rows"][1].update(cost="0.1"), "cost"),
    ("an interval beside its cost", lambda d: d["rows"][1].update(low=0.2, high=0.3), "interval"),
    ("quicker than its dot product", lambda d: d["rows"].append(row("schlick", 0.01)), "dot product"),
    ("an unknown key of a row", lambda d: d["rows"][0].update(colour="red"), "colour"),
    ("no exact Phong", lambda d: d["rows"].pop(0), "exact Phong"),
    ("no rows", lambda d: d.update(rows=[]), "exact Phong"),
    ("rows that are none", lambda d: d.update(rows={"a": 1}), "rows"),
    ("no dot product", lambda d: d.pop("dot"), "dot is missing"),
)


@pytest.mark.parametrize(("change", "told"), [one[1:] for one in WRONG], ids=[one[0] for one in WRONG])
def test_what_cannot_be_is_refused_and_nothing_is_written(
    change: Callable[[Document], Any], told: str, document: Document, written, tmp_path: Path
) -> None:
    change(document)
    with pytest.raises(InputError) as caught:
        measured.add(written(document), tmp_path / "runs")
    assert told in str(caught.value)
    assert "download.json" in str(caught.value)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("text", ["", "[]", "null", '{"schema": 1', "[" * 100_000, '{"schema": 1' + "0" * 5000 + "}"])
def test_a_file_that_is_no_measurement_is_refused(text: str, written, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        measured.add(written(text), tmp_path / "runs")
    for path in (tmp_path / "absent.json", tmp_path, tmp_path / "plan.toml"):
        with pytest.raises(InputError, match="measure it again"):
            measured.add(path, tmp_path / "runs")


def test_one_that_was_changed_meanwhile_does_not_hide_the_others(document: Document, written, tmp_path: Path) -> None:
    measured.add(written(document), tmp_path)
    (tmp_path / "targets" / "page-broken.json").write_text("{")
    measured.place_of("page-renamed", tmp_path).write_text(json.dumps(document))
    rows = {one["name"]: one for one in listing(tmp_path)}
    assert (rows["page-adreno-740"]["available"], rows["page-adreno-740"]["rows"]) == (True, 3)
    assert rows["page-adreno-740"]["title"] == "Adreno (TM) 740"
    assert "page-broken.json" in rows["page-broken"]["why_not"]
    assert "holds page-adreno-740" in rows["page-renamed"]["why_not"]
    with pytest.raises(UnknownNameError, match="page-adreno-740"):
        measured.added("page-absent", tmp_path)


def test_the_command_adds_and_lists(document: Document, written, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = written(document)
    added = CliRunner().invoke(main, ["targets", "add", str(file)])
    assert added.exit_code == 0, added.output
    assert "page-adreno-740: Adreno (TM) 740, 3 codes by WebGPU" in added.output
    told = json.loads(CliRunner().invoke(main, ["targets", "add", str(file), "--json"]).output)
    assert Path(told["path"]) == Path("phongbench-runs/targets/page-adreno-740.json")
    assert "page-adreno-740" in CliRunner().invoke(main, ["targets"]).output
    refused = CliRunner().invoke(main, ["targets", "add", str(written({"schema": 7}))])
    assert refused.exit_code == 2
    assert "schema 7" in refused.output


def test_a_recommendation_for_it_is_by_its_times(document: Document, written, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    measured.add(written(document))
    question = ["recommend", "--alpha", "50", "--max-error", "0.05", "--target", "page-adreno-740"]
    answer = json.loads(CliRunner().invoke(main, [*question, "--json"]).output)
    best = answer["choices"][0]
    assert (best["target"], best["cost_kind"], best["unit"], best["bound_by"]) == (
        "page-adreno-740", "measured", "ns", None,
    )  # fmt: skip
    assert (best["approximation"], best["cost"]) == ("lyon", 0.1)
    assert best["ratio_low"] < best["ratio"] < best["ratio_high"]
    assert "on page-adreno-740" in best["why"]
    assert "99 % interval" in CliRunner().invoke(main, question).output
    short = CliRunner().invoke(main, [*question, "--short-of", "special"])
    assert short.exit_code == 2
    assert "compiled target" in short.output
    unknown = CliRunner().invoke(main, [*question[:-1], "page-other"])
    assert unknown.exit_code == 2
    assert "page-adreno-740" in unknown.output
