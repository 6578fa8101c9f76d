"""AMD's GPUs by Mesa's compiler: what hand-written code costs, and what becomes of code and drivers that fail."""

from dataclasses import replace

import pytest

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.targets import radv
from phongbench.targets.chips import target_named
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.harness import UNROLLED
from phongbench.targets.measure import CONTEXTS, bare, costs
from phongbench.targets.target import Counts

HEAD = "float highlight(vec3 a, vec3 b) {{ float d = dot(a, b); {} }}"
POWER = HEAD.format("return pow(max(d, 0.0), 50.0);")
GAUSSIAN = HEAD.format("return exp2(72.0 * d - 72.0);")
LYON = HEAD.format("float x = clamp(6.25 * d - 5.25, 0.0, 1.0); x *= x; x *= x; return x * x;")


@pytest.fixture(scope="module", autouse=True)
def compiler() -> None:
    if (missing := target_named("rdna2").why_not()) is not None:
        pytest.skip(missing)


@pytest.mark.parametrize(
    ("target", "power", "gaussian", "lyon"),
    # A wave of 64 issues an instruction in 2 cycles, or 4, and a special one in 2, or 16; a chain's last product is one
    # with the sum. RDNA 2 needs a maximum and a power, GCN 4 reads one constant at a time.
    [("rdna2", 4 * 2, 2 * 2, 3 * 2), ("gcn4", 2 * 4 + 2 * 16, 2 * 4 + 16, 4 * 4)],
)
def test_costs_are_instructions_times_cycles(target: str, power: float, gaussian: float, lyon: float) -> None:
    found = costs(target_named(target), [Code("", text) for text in (POWER, GAUSSIAN, LYON)])
    assert [cost.cost for cost in found] == pytest.approx([power, gaussian, lyon], abs=0.3)
    assert [cost.issue for cost in found] == pytest.approx([power, gaussian, lyon], abs=0.3)
    assert [cost.specials for cost in found] == [2, 1, 0]


@pytest.mark.parametrize("target", ["rdna3", "gcn5"])
def test_what_multiply_adds_around_change_is_computed_as_compiled(target: str) -> None:
    chip, every = target_named(target), (Code("", POWER), bare("glsl", 2, dot=True))
    assert isinstance(chip, radv.Radv)
    power, dot = (chip.compile([chip.program(one, UNROLLED, context) for context in CONTEXTS]) for one in every)
    computed = [[chip.surrounded(found[0], context * UNROLLED) for context in CONTEXTS] for found in (power, dot)]
    predicted = [more.cycles - less.cycles for more, less in zip(*computed, strict=True)]
    assert [more.cycles - less.cycles for more, less in zip(power, dot, strict=True)] == predicted


def test_a_special_unit_hides_behind_enough_other_work() -> None:
    alone = Counts(cycles=640, issue=320, special=640, instructions=1, arithmetic=1, specials=1, latency=0, registers=1)
    chip = target_named("rdna2")
    assert isinstance(chip, radv.Radv)
    assert [chip.surrounded(alone, context * UNROLLED).cycles for context in CONTEXTS] == [
        640,
        320 + 8 * 64,
        320 + 32 * 64,
        320 + 128 * 64,
    ]


def test_instructions_that_the_disassembler_abbreviates_count() -> None:
    text = (
        "BB0:\n\tv_mul_f32_e32 v0, v0, v0   ; 10\n\t(then repeated 3 times)\n\tv_exp_f32_e32 v0, v0  ; 7e\n\ts_endpgm\n"
    )
    told = {"Inverse Throughput": 10, "Instructions": 6, "Latency": 30, "VGPRs": 8}
    chip = target_named("rdna2")
    assert isinstance(chip, radv.Radv)
    counts = chip._counts({"statistics": told, "assembly": text})
    assert (counts.arithmetic, counts.specials) == (4, 1)


def test_code_that_is_none_is_refused_with_the_compilers_words() -> None:
    with pytest.raises(InputError, match=r"glslang refuses the code: line \d+.*nonsense") as caught:
        costs(target_named("rdna2"), [Code("", "float highlight(vec3 a, vec3 b) { return nonsense; }")])
    assert "/" not in caught.value.what.partition("'")[0]


def test_a_driver_that_fails_is_told_and_takes_nothing_with_it() -> None:
    with pytest.raises(InputError, match="RADV failed for NOCHIP"):
        costs(replace(target_named("rdna2"), chip="NOCHIP"), [Code("", POWER)])


@pytest.mark.parametrize(
    ("gone", "said"),
    [("shutil.which", "glslang-tools"), ("phongbench.targets.radv.find_spec", "pip install"), ("_manifest", "mesa")],
)
def test_what_is_missing_is_named_with_its_package(gone: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gone if "." in gone else f"phongbench.targets.radv.{gone}", lambda *_: None)
    chip = target_named("gcn4")
    assert said in str(chip.why_not())
    with pytest.raises(InputError, match="cannot compile for gcn4"):
        costs(chip, [])


CROSS = """float highlight(vec3 a, vec3 b) {
    vec3 c = cross(a, b);
    float x = clamp(1.0 - 3.125 * dot(c, c), 0.0, 1.0);
    x *= x; x *= x; x *= x;
    return dot(a, b) > 0.0 ? x : 0.0;
}"""
SCHLICK = HEAD.format("d = max(d, 0.0); return d / (50.0 - 50.0 * d + d);")


@pytest.mark.parametrize("target", ["gcn4", "gcn5", "rdna2", "rdna3"])
def test_written_code_costs_no_more_than_the_best_by_hand(target: str) -> None:
    by_hand = {"phong": POWER, "gaussian:dot": GAUSSIAN, "lyon:dot:8": LYON, "lyon:cross:8": CROSS, "schlick": SCHLICK}
    ours = [code(Formula.parse(name), 50.0, "glsl") for name in by_hand]
    found = costs(target_named(target), [*ours, *(Code("", text) for text in by_hand.values())])
    for name, written, hand in zip(by_hand, found, found[len(ours) :], strict=False):
        assert written.cost <= hand.cost, name
