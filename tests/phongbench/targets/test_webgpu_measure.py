"""Programs that are timed do what they say, and their times become costs; on the adapter that is here."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from webgpu_here import adapter_here

from phongbench.errors import MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.results.schema import COPY, DOT, TWIN
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.measure import bare
from phongbench.targets.webgpu import measure, programs
from phongbench.targets.webgpu.programs import CONTEXTS, LONGER, Context
from phongbench.targets.webgpu.rounds import Times
from phongbench.targets.webgpu.session import Session

NAMES = ("phong", "gaussian:dot", "lyon:dot:8", "lyon:cross:8/once", "phong@reflect/each")


def code_of(name: str) -> Code:
    return code(Formula.parse(name), 50.0, "wgsl")


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    adapter_here()
    with Session() as one:
        yield one


@pytest.mark.parametrize("context", CONTEXTS, ids=lambda c: f"{c.multiply_adds}-{c.reads}")
@pytest.mark.parametrize("name", NAMES)
def test_a_program_calls_the_formula_so_often_amid_so_much(name: str, context: Context) -> None:
    one = code_of(name)
    text = programs.timed(one, 8, context)
    assert one.text in text
    assert text.count("total += highlight(") == 8
    assert text.count("factor.w") == 8 * context.multiply_adds
    assert text.count("texels[at]") == 8 * (context.reads > 0)
    assert text.count("= a.yzx") == text.count("= b.yzx") == 8  # every vector moves, or work could be done once for all
    assert text.count("= c.yzx") == (8 if one.vectors == 3 else 0)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_timed_adds_up_the_formulas_values(session: Session, name: str) -> None:
    """Three calls turn every vector once about, so their sum is that of the formula's values on these three."""
    one = code_of(name)
    drawn = np.random.default_rng(3).normal(size=(256, 3, 4))
    drawn[..., 3] = 0
    given = (drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)).astype(np.float32)
    turned = [given[..., order] for order in ([1, 2, 0, 3], [2, 0, 1, 3], [0, 1, 2, 3])]
    values = [session.ask("values", texts=[programs.evaluating(one, False)], given=turn)[0] for turn in turned]
    found = session.ask("values", texts=[programs.timed(one, 3, Context())], given=given)[0]
    kept = sum(given[:, k, :3].sum(axis=1) for k in range(one.vectors))
    assert found == pytest.approx(sum(values) + kept, abs=2e-5)
    assert max(value.max() for value in values) > 0.1


def test_the_adapter_takes_every_context(session: Session) -> None:
    given = np.full((64, 3, 4), 0.5, np.float32)
    texts = [programs.timed(code_of("lyon:dot:8"), 1, context) for context in CONTEXTS]
    found = session.ask("values", texts=texts, given=given)
    assert all(np.isfinite(values).all() for values in found)


def test_the_adapter_gives_a_row_of_each_and_a_code_that_it_refuses_concerns_itself_alone(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(measure, "COPIED", 1 << 20)
    broken = Code("broken 1", "fn highlight(r: vec3f, v: vec3f) -> f32 { return nonsense; }")
    found = measure.measure(session, adapter_here(), [code_of("lyon:dot:8"), broken], seconds=0.0)
    assert set(found.refused) == {"broken 1"}
    assert "nonsense" in found.refused["broken 1"]
    named = {name for name, _ in found.rows}
    assert {"phong", COPY} <= named <= {"phong", TWIN, DOT, COPY, "lyon:dot:8 50"}
    assert {context for _, context in found.rows} == {CONTEXTS[0]}
    assert found.adapter.title in found.tool
    assert ("no GPU" in found.tool) == found.adapter.software
    assert found.rows["phong", CONTEXTS[0]].ratio.middle == 1


def made(ns: dict[str, float], rounds: int = 24, noise: float = 0.002) -> Times:
    """Times of what `_work` lists, each call this long, what carries it besides."""
    work = list(measure._work([code_of("lyon:dot:8")], [code_of("lyon:dot:8")]))
    random = np.random.default_rng(2)
    drift = 1 + 0.3 * random.random((rounds, 1))  # a clock that moves, as GPUs' do
    each = np.array([0.5 + ns[name] * (1 + context.multiply_adds / 8) for name, context, _ in work])
    used = each * drift * (1 + noise * random.normal(size=(rounds, len(each))))
    return Times(tuple(measure._label(*key) for key in work), used, (0,) * len(work), "timestamps", None, {})


NS = {"phong": 0.8, TWIN: 0.8, DOT: 0.1, "lyon:dot:8 50": 0.2, "nothing": 0.0}


def test_costs_are_ratios_of_what_a_formula_adds_in_each_context() -> None:
    found = made(NS)
    work = list(measure._work([code_of("lyon:dot:8")], [code_of("lyon:dot:8")]))
    rows = measure._compared(found, work)
    for context in CONTEXTS:
        lyon = rows["lyon:dot:8 50", context]
        assert lyon.ratio.middle == pytest.approx(0.25, rel=0.02)
        assert lyon.ratio.low < 0.25 < lyon.ratio.high or abs(lyon.ratio.middle / 0.25 - 1) < 0.01
        assert lyon.over_dot == pytest.approx(2.0, rel=0.1)
        assert lyon.verdict == "faster"
    assert rows[TWIN, CONTEXTS[0]].verdict == "unresolved"
    assert ("nothing", CONTEXTS[0]) not in rows


def test_a_device_that_shows_no_difference_is_no_measurement() -> None:
    found = made({**NS, "phong": 0.0}, noise=0.0)
    work = list(measure._work([code_of("lyon:dot:8")], [code_of("lyon:dot:8")]))
    with pytest.raises(MeasurementError, match="no longer than nothing"):
        measure._compared(found, work)


def test_a_device_that_refuses_exact_phong_is_no_measurement() -> None:
    found = made(NS)
    work = list(measure._work([code_of("lyon:dot:8")], [code_of("lyon:dot:8")]))
    for lost in (0, 2):  # exact Phong, and the dot product
        kept = [i for i in range(len(work)) if i != lost]
        few = replace(found, used=found.used[:, kept], refused={found.names[lost]: "no such opcode"})
        with pytest.raises(MeasurementError, match="no such opcode"):
            measure._compared(few, [work[i] for i in kept])


def test_tables_are_copied_for_each_call_so_their_programs_are_short() -> None:
    table = Code("table", "var<private> TABLE: array<f32, 2> = array<f32, 2>(1.0, 2.0);")
    assert Context().calls(table) < Context().calls(bare("wgsl", 2, dot=True))
    assert all(LONGER * context.multiply_adds * context.calls(table) <= 512 for context in CONTEXTS)


def test_rounds_in_which_a_formula_seems_to_take_no_time_do_not_make_it_dearer() -> None:
    work = list(measure._work([code_of("lyon:dot:8")], [code_of("lyon:dot:8")]))
    cheap = {**NS, DOT: 0.01, "lyon:dot:8 50": 0.02}  # of noise as large as they are
    rows = measure._compared(made(cheap, rounds=201, noise=0.02), work)
    assert rows[DOT, CONTEXTS[0]].ratio.low <= 0.01 / 0.8 <= rows[DOT, CONTEXTS[0]].ratio.high
    assert rows["lyon:dot:8 50", CONTEXTS[0]].ratio.middle == pytest.approx(0.02 / 0.8, rel=0.3)
