"""NVIDIA's GPUs by its own compiler: what hand-written code takes of each unit, and what becomes of code that fails."""

from dataclasses import replace

import pytest

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.targets import nvidia
from phongbench.targets.chips import target_named
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.harness import UNROLLED
from phongbench.targets.measure import CONTEXTS, costs
from phongbench.targets.target import Counts

NAMES = [target.name for target in nvidia.TARGETS]
HEAD = "__device__ inline float highlight(float3 a, float3 b) {{ float d = a.x * b.x + a.y * b.y + a.z * b.z; {} }}"
POWER = HEAD.format("return __powf(fmaxf(d, 0.0f), 50.0f);")
GAUSSIAN = HEAD.format("return exp2f(72.0f * d - 72.0f);")
LYON = HEAD.format("float x = __saturatef(6.25f * d - 5.25f); x *= x; x *= x; return x * x;")
#: as the disassembler prints them: a predicate, a minimum, a special function, a padding
ASSEMBLY = """
        /*0000*/                   LDG.E.CONSTANT R6, [R4.64+0x8] ;
        /*0010*/               @P0 FMNMX.FTZ R4, RZ, R4, !PT ;
        /*0020*/                   FFMA.FTZ R10, R6, 1.25, R7 ;
        /*0030*/                   MUFU.LG2 R21, R4 ;
        /*0040*/                   EXIT ;
        /*0050*/                   NOP;
"""


@pytest.fixture
def compiler() -> None:
    if (missing := target_named("sm89").why_not()) is not None:
        pytest.skip(missing)


def chip(name: str) -> nvidia.Nvidia:
    found = target_named(name)
    assert isinstance(found, nvidia.Nvidia)
    return found


def counted(name: str, text: str) -> Counts:
    return chip(name)._counts(text)


def test_each_instruction_goes_to_its_unit() -> None:
    counts = counted("sm89", ASSEMBLY)
    assert (counts.instructions, counts.arithmetic, counts.half_rate, counts.specials) == (5, 2, 1, 1)
    assert counts.registers == 22
    assert (counts.issue, counts.special, counts.cycles) == (5, 8, 8)


def test_turing_adds_at_half_the_rate() -> None:
    line = "        /*0000*/                   FADD R1, R1, R2 ;\n"
    assert (counted("sm75", line * 10).cycles, counted("sm86", line * 10).cycles) == (20, 10)


def test_minima_and_choices_issue_at_half_the_rate_everywhere() -> None:
    line = "        /*0000*/                   FSEL R1, R1, R2, P0 ;\n"
    assert [counted(name, line * 10).cycles for name in NAMES] == [20] * len(NAMES)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("target", NAMES)
def test_a_power_takes_two_of_both_units_a_gaussian_one_and_squarings_none(target: str) -> None:
    found = costs(target_named(target), [Code("", text) for text in (POWER, GAUSSIAN, LYON)])
    assert [cost.specials for cost in found] == [2, 1, 0]
    assert [cost.arithmetic for cost in found] == pytest.approx([2, 1, 4], abs=0.05)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("target", ["sm75", "sm90"])
def test_what_multiply_adds_around_change_is_computed_as_compiled(target: str) -> None:
    made, one = chip(target), Code("power", POWER)
    first, *rest = made.compile([made.program(one, UNROLLED, context) for context in CONTEXTS])
    for context, counts in zip(CONTEXTS[1:], rest, strict=True):
        # what the compiler moves about to have constants at hand
        assert counts.cycles == pytest.approx(made.surrounded(first, context * UNROLLED).cycles, abs=0.4 * UNROLLED)


@pytest.mark.usefixtures("compiler")
def test_written_code_costs_no_more_than_by_hand() -> None:
    by_hand = {"phong": POWER, "gaussian:dot": GAUSSIAN, "lyon:dot:8": LYON}
    ours = [code(Formula.parse(name), 50.0, "cuda") for name in by_hand]
    found = costs(target_named("sm89"), [*ours, *(Code(name, text) for name, text in by_hand.items())])
    for name, written, hand in zip(by_hand, found, found[len(ours) :], strict=False):
        assert (written.specials, written.cost) <= (hand.specials, hand.cost + 1), name


@pytest.mark.usefixtures("compiler")
def test_code_that_is_none_is_refused_with_its_name_and_the_compilers_words() -> None:
    with pytest.raises(InputError, match=r"mine 50\(1\): error: .*nonsense"):
        costs(target_named("sm120"), [Code("mine 50", HEAD.format("return nonsense;"))])


@pytest.mark.usefixtures("compiler")
def test_a_chip_that_the_compiler_does_not_know_is_told() -> None:
    with pytest.raises(InputError, match="sm_10"):
        costs(replace(chip("sm75"), chip="sm_10"), [Code("power", POWER)])


def test_without_the_compiler_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nvidia, "_installed", lambda pattern: None)
    for ask in (lambda: costs(chip("sm89"), []), chip("sm89").tool_version):
        with pytest.raises(InputError, match=r"cannot compile for sm89 here: pip install 'phongbench\[targets\]'"):
            ask()


def test_programs_are_compiled_in_groups_and_come_back_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nvidia.Nvidia, "checked", lambda self: None)
    monkeypatch.setattr(nvidia, "_assembly", lambda group, chip: list(group))
    monkeypatch.setattr(nvidia.Nvidia, "_counts", lambda self, text: text)
    programs = [str(number) for number in range(2 * nvidia._TOGETHER + 1)]
    assert list[object](chip("sm89").compile(programs)) == programs
