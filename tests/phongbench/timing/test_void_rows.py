"""When a timing says nothing: kernels that are wrong, fail, or are compiled meanwhile."""

from dataclasses import replace

import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import MeasurementError
from phongbench.formulas.registry import REGISTRY
from phongbench.timing import blocks, timed_kernels
from phongbench.timing.measure import measure
from phongbench.timing.timed_kernels import TimedFormula

LYON = TimedFormula.of("lyon:difference:8", FLOAT32)
compiled_only = pytest.mark.skipif(jit.DISABLED, reason="plain Python is not timed")


def measured(formula: TimedFormula) -> tuple[set[str], list[str]]:
    timing = measure([formula], budget_seconds=2.0, working_sets=["l1"])
    return set(timing.rows["approximation"]), [str(problem) for problem in timing.problems]


LIAR = TimedFormula.of("liar", FLOAT32, registry={"liar": replace(REGISTRY["phong"], name="liar")})


@compiled_only
def test_a_kernel_that_computes_something_else_is_void(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = timed_kernels._plain
    monkeypatch.setattr(
        timed_kernels, "_plain", lambda t: (lambda a, b: plain(t)(a, b) + 0.01) if t.name == "liar" else plain(t)
    )
    names, problems = measured(LIAR)
    assert "liar" not in names
    assert "lyon" not in names
    assert "phong" in names
    assert len(problems) == 1
    assert "liar none reflect float32, l1: 100% of its values differ" in problems[0]


@compiled_only
def test_a_timed_output_that_differs_from_the_verified_one_voids_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = blocks.Block.digest
    calls: list[str] = []

    def digest(block: blocks.Block, share: int = 0) -> int:
        value = honest(block, share)
        calls.append("")
        # the first look at each kernel's output is the verification; lyon's later outputs come out wrong
        return value ^ 1 if value == known.get("lyon") and len(calls) > len(block.kernels) else value

    known: dict[str, int] = {}
    verify = blocks.Block.verify

    def remember(block: blocks.Block) -> list[MeasurementError]:
        problems = verify(block)
        known.update({kernel.name: d for kernel, d in zip(block.kernels, block.digests, strict=True)})
        return problems

    monkeypatch.setattr(blocks.Block, "digest", digest)
    monkeypatch.setattr(blocks.Block, "verify", remember)
    names, problems = measured(LYON)
    assert "lyon" not in names
    assert "phong" in names
    assert [p.splitlines()[0] for p in problems] == [
        "lyon difference reflect 8 float32, l1: a timed output differs from the verified one; its row is left out"
    ]


@compiled_only
def test_a_kernel_that_does_not_compile_fails_alone() -> None:
    broken = replace(REGISTRY["phong"], name="broken", coefficients=lambda s: {"alpha": 1 / 0})
    names, problems = measured(replace(LIAR, spec=broken))
    assert "phong" in names
    assert "broken: cannot be compiled: division by zero" in problems[0]


@compiled_only
def test_compiling_while_timing_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    def late(block: blocks.Block, step: float) -> None:
        numba.njit(lambda x: x + 1)(1)
        calibrate(block, step)

    calibrate = blocks.Block.calibrate
    monkeypatch.setattr(blocks.Block, "calibrate", late)
    with pytest.raises(MeasurementError, match="compiled while timing"):
        measure([LYON], budget_seconds=2.0, working_sets=["l1"])
