"""What formulas cost on a target: programs with the formula, less programs with a bare dot product."""

from collections.abc import Sequence
from dataclasses import dataclass

from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.formulas.shader_code.languages import language_named
from phongbench.targets.code_shapes import Code
from phongbench.targets.target import ISSUE, SPECIAL, Counts, Target

#: multiply-adds around each call, of other work that a shader has; costs are quoted in the first
CONTEXTS = (0, 8, 32, 128)
#: of a cost: the tools tell tenths and wholes of programs that call a formula up to 32 times, for up to 16 elements
DECIMALS = 6


@dataclass(frozen=True, slots=True)
class Cost:
    """What one highlight costs beyond the dot product of its first two directions, in the target's unit.

    around        cost by context, in the order of CONTEXTS: where other work keeps a unit busy, differences shrink
    issue         cost in a shader that the issue of instructions limits
    special       cost in a shader that the special unit limits
    instructions  all of them
    arithmetic    those without the special ones
    specials      logarithms, exponentials, roots and reciprocals
    latency       cycles that it adds to one wave or thread alone
    registers     of the whole unrolled program
    bound_by      what limits the program of the first context: issue or special
    """

    around: tuple[float, ...]
    issue: float
    special: float
    instructions: float
    arithmetic: float
    specials: float
    latency: float
    registers: int
    bound_by: str

    @property
    def cost(self) -> float:
        """In the first context."""
        return self.around[0]

    def short_of(self, unit: str | None) -> float:
        """The cost that counts in a shader which is short of this unit; None: of none in particular."""
        return {None: self.cost, ISSUE: self.issue, SPECIAL: self.special}[unit]


def bare(language: str, vectors: int, precision: str = FLOAT32, *, dot: bool) -> Code:
    """What costs are counted beyond: the dot product of the first two directions, or of that its first factor."""
    spelled = language_named(language).in_precision(precision)
    kind, name = spelled.direction
    header = spelled.header(spelled.float_type, "highlight", [(kind, name.format(x)) for x in "abc"[:vectors]])
    before = f"{spelled.preamble}\n" if spelled.preamble and precision != FLOAT32 else ""
    axes = spelled.components or (".x", ".y", ".z")
    terms = [f"a{axis} * b{axis}" for axis in axes]
    value = " + ".join(terms) if dot else f"a{axes[0]}"
    text = f"{before}{header} {{\n    return {value};\n}}"
    return Code("dot" if dot else "nothing", text, vectors, precision)


def costs(target: Target, codes: Sequence[Code], contexts: Sequence[int] = CONTEXTS) -> list[Cost]:
    """The cost of each code on the target, compiled here, in these contexts: the first is what a cost is quoted in.

    InputError where a tool is missing or refuses a code.
    """
    kinds = sorted({(target.calls(one), one.vectors, one.precision) for one in codes})
    references = [(bare(target.language, n, precision, dot=True), calls) for calls, n, precision in kinds]
    found = target.checked().counted([*references, *((one, target.calls(one)) for one in codes)], contexts)
    less = dict(zip(kinds, found, strict=False))
    return [
        _cost(whole, less[target.calls(one), one.vectors, one.precision], target.calls(one))
        for one, whole in zip(codes, found[len(kinds) :], strict=True)
    ]


def dot_cost(target: Target, precision: str = FLOAT32) -> Cost:
    """What the bare dot product itself costs."""
    codes = [bare(target.language, 2, precision, dot=dot) for dot in (True, False)]
    dot, nothing = target.checked().counted([(code, target.calls(code)) for code in codes], CONTEXTS)
    return _cost(dot, nothing, target.calls(codes[0]))


def _cost(whole: Sequence[Counts], reference: Sequence[Counts], calls: int) -> Cost:
    """The difference of a call, from programs with it and without it in each context."""
    first, less = whole[0], reference[0]

    def each(name: str, whole: Counts = first, reference: Counts = less) -> float:
        return round(float(getattr(whole, name) - getattr(reference, name)) / calls, DECIMALS)

    return Cost(
        around=tuple(each("cycles", w, r) for w, r in zip(whole, reference, strict=True)),
        issue=each("issue"),
        special=each("special"),
        instructions=each("instructions"),
        arithmetic=each("arithmetic"),
        specials=each("specials"),
        latency=each("latency"),
        registers=first.registers,
        bound_by=SPECIAL if first.special > first.issue else ISSUE,
    )
