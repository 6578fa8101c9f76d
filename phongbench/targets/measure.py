"""What formulas cost on a target: programs with the formula, less programs with a bare dot product."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from phongbench.formulas.shader_code.languages import language_named
from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import UNROLLED, WITH_TABLE
from phongbench.targets.target import ISSUE, SPECIAL, Counts, Target

#: multiply-adds around each call, of other work that a shader has; costs are quoted in the first
CONTEXTS = (0, 8, 32, 128)


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


def bare(language: str, vectors: int, *, dot: bool) -> Code:
    """What costs are counted beyond: the dot product of the first two directions, or of that its first factor."""
    spelled = language_named(language)
    kind, name = spelled.direction
    header = spelled.header(spelled.float_type, "highlight", [(kind, name.format(x)) for x in "abc"[:vectors]])
    axes = spelled.components or (".x", ".y", ".z")
    terms = [f"a{axis} * b{axis}" for axis in axes]
    value = " + ".join(terms) if dot else f"a{axes[0]}"
    return Code("dot" if dot else "nothing", f"{header} {{\n    return {value};\n}}", vectors)


def costs(target: Target, codes: Sequence[Code]) -> list[Cost]:
    """The cost of each code on the target, compiled here; InputError where a tool is missing or refuses a code."""
    kinds = sorted({(_calls(one), one.vectors) for one in codes})
    references = [(bare(target.language, vectors, dot=True), calls) for calls, vectors in kinds]
    found = _compiled(target, [*references, *((one, _calls(one)) for one in codes)])
    less = dict(zip(kinds, found, strict=False))
    return [
        _cost(whole, less[_calls(one), one.vectors], _calls(one))
        for one, whole in zip(codes, found[len(kinds) :], strict=True)
    ]


def dot_cost(target: Target) -> Cost:
    """What the bare dot product itself costs."""
    dot, nothing = _compiled(target, [(bare(target.language, 2, dot=dot), UNROLLED) for dot in (True, False)])
    return _cost(dot, nothing, UNROLLED)


def _calls(code: Code) -> int:
    return WITH_TABLE if code.has_table else UNROLLED


def _compiled(target: Target, codes: Sequence[tuple[Code, int]]) -> list[list[Counts]]:
    """Counts of the program that calls each code so often, in each context."""
    contexts = CONTEXTS if target.multiply_add is None else CONTEXTS[:1]
    every = [target.program(code, calls, context) for code, calls in codes for context in contexts]
    found = target.checked().compile(every)
    if target.multiply_add is None:
        return [found[i : i + len(contexts)] for i in range(0, len(found), len(contexts))]
    return [surrounded(one, target.multiply_add, calls) for one, (_, calls) in zip(found, codes, strict=True)]


def surrounded(counts: Counts, multiply_add: float, calls: int = UNROLLED) -> list[Counts]:
    """The counts of a program in every context, from those of the first: multiply-adds only add to what is issued.

    multiply_add  what one takes
    """
    issue = counts.issue if counts.special > counts.issue else counts.cycles
    more = [context * calls for context in CONTEXTS]
    return [
        replace(
            counts,
            cycles=max(issue + n * multiply_add, counts.special),
            issue=counts.issue + n * multiply_add,
            instructions=counts.instructions + n,
            arithmetic=counts.arithmetic + n,
        )
        for n in more
    ]


def _cost(whole: Sequence[Counts], reference: Sequence[Counts], calls: int) -> Cost:
    """The difference of a call, from programs with it and without it in each context."""
    first, less = whole[0], reference[0]

    def each(name: str) -> float:
        return float(getattr(first, name) - getattr(less, name)) / calls

    return Cost(
        around=tuple((w.cycles - r.cycles) / calls for w, r in zip(whole, reference, strict=True)),
        issue=each("issue"),
        special=each("special"),
        instructions=each("instructions"),
        arithmetic=each("arithmetic"),
        specials=each("specials"),
        latency=each("latency"),
        registers=first.registers,
        bound_by=SPECIAL if first.special > first.issue else ISSUE,
    )
