"""What was measured on an adapter, and how far the compiler's model of its family is off."""

from types import SimpleNamespace
from typing import Any

import pytest

from phongbench.analysis.adapter import family_of, measured
from phongbench.analysis.rows import Rows
from phongbench.formulas.formula import Formula
from phongbench.results.schema import ACCURACY, DOT, TABLES
from phongbench.study.target_costs import named
from phongbench_reports.table import Absent, Table
from phongbench_reports.tables.adapter import adapter

RATIOS = {"phong": 1.0, "lyon:dot:8": 0.5, "gaussian:dot": 0.4}
MODEL = {"phong": 1.0, "lyon:dot:8": 0.8, "gaussian:dot": 0.5}
TOLD = {"cost": 1.0, "unit": "ns", "tool": "WebGPU", "tool_version": "1", "context": 0, "reads": 0}


def about(name: str) -> dict[str, Any]:
    return {**named(Formula.parse(name), 50.0), **TOLD}


def run(adapter_name: str = "Radeon RX 6800 XT", *, gpu: bool = True) -> Rows:
    """A run that measured an adapter, beside the costs of RDNA 2."""
    rows: list[dict[str, Any]] = []
    for name, ratio in RATIOS.items():
        mine = {**about(name), "target": "gpu", "cost_kind": "measured", "ratio": ratio}
        mine |= {"ratio_low": 0.9 * ratio, "ratio_high": 1.1 * ratio}
        around = {**mine, "cost": ratio / 10}
        rows += [mine, {**around, "context": 32}, {**around, "reads": 4}] if gpu else []
        rows.append({**about(name), "target": "rdna2", "cost_kind": "compiled", "ratio": MODEL[name]})
    rows += [{**rows[0], "approximation": DOT}]
    errors = [
        {**named(Formula.parse(name), 50.0), "precision": held, "perturbation": "none", "truth": "angle",
         "max_abs": 0.01 * scale, "coverage": coverage, "device": "gpu", "stratum": "vectors"}
        for name in RATIOS for held, scale in (("float32", 1), ("float16", 4))
        for coverage, scale in (("sampled", scale / 2), ("searched", scale))
    ]  # fmt: skip
    device = ACCURACY.frame().reindex(range(len(errors))).assign(**{k: [e[k] for e in errors] for k in errors[0]})
    facts = {"adapter": adapter_name, "software": False, "tool": "WebGPU", "tool_version": "1"}
    manifest = {"gpu": {**facts, "rounds": 24, "twin": "unresolved"}} if gpu else {}
    made = SimpleNamespace(costs=TABLES["costs"].frame(rows), device_accuracy=device, manifest=manifest, path=None)
    return Rows(made)


@pytest.mark.parametrize(
    ("adapter_name", "family"),
    [
        ("AMD Radeon RX 6800 XT (RADV NAVI21)", "rdna2"),
        ("AMD Radeon RX 7900 XTX (RADV GFX1100)", "rdna3"),
        ("AMD Radeon RX 480 Graphics (RADV POLARIS10)", "gcn4"),
        ("AMD Radeon RX Vega (RADV VEGA10)", "gcn5"),
        ("NVIDIA GeForce RTX 2080", "sm75"),
        ("NVIDIA GeForce RTX 3060 Ti", "sm86"),
        ("NVIDIA GeForce RTX 4090", "sm89"),
        ("NVIDIA H200", "sm90"),
        ("NVIDIA GeForce RTX 5080", "sm120"),
        ("Mali-G78", None),
        ("Apple M2", None),
        ("llvmpipe (LLVM 15.0.6, 256 bits), a software adapter on the processor, no GPU", None),
    ],
)
def test_an_adapters_name_tells_its_family_or_nothing(adapter_name: str, family: str | None) -> None:
    assert family_of(adapter_name) == family


def test_measured_stands_beside_compiled_in_each_context_with_the_largest_errors() -> None:
    data = measured(run()).set_index("approximation")
    assert list(data.index) == ["gaussian", "lyon", "phong"]
    assert data["model"].to_dict() == {"gaussian": 0.5, "lyon": 0.8, "phong": 1.0}
    assert data["off"].to_dict() == pytest.approx({"gaussian": 0.8, "lyon": 0.625, "phong": 1.0})
    assert data["in_32"].to_dict() == pytest.approx({"gaussian": 0.04, "lyon": 0.05, "phong": 0.1})
    assert data["reading"].to_dict() == pytest.approx({"gaussian": 0.04, "lyon": 0.05, "phong": 0.1})
    assert set(data["float32"]) == {0.01}
    assert set(data["float16"]) == {0.04}


def test_the_table_says_what_the_adapter_is_and_how_far_the_model_is_off() -> None:
    table = adapter(run())
    assert isinstance(table, Table)
    assert table.headings == (
        "formula", "ns", "/ exact Phong", "ns amid 32", "ns, reading", "rdna2, compiled", "measured / compiled",
        "error, float32", "error, float16",
    )  # fmt: skip
    assert [row[0] for row in table.rows] == ["gaussian:dot", "lyon:dot:8", "phong"]
    assert table.rows[0][2] == "0.400 [0.360, 0.440]"
    assert "Radeon RX 6800 XT" in table.takeaway
    assert "0.625 to 1 times" in table.takeaway


def test_without_a_family_there_is_no_model_and_without_an_adapter_no_table() -> None:
    table = adapter(run("Mali-G78"))
    assert isinstance(table, Table)
    assert "measured / compiled" not in table.headings
    assert table.takeaway.endswith("the least.")
    assert isinstance(adapter(run(gpu=False)), Absent)
