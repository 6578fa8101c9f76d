"""A compiled target: a chip whose compiler, or a scheduling model of it, says what machine code costs.

Such a cost is counted, not timed: it has no interval, and is the same to the digit wherever the same compiler makes it.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from phongbench.errors import InputError
from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import UNROLLED, WITH_TABLE

#: what limits a program: the issue of instructions, or the unit of logarithms, exponentials and roots
UNITS = ISSUE, SPECIAL = "issue", "special"


@dataclass(frozen=True, slots=True)
class Counts:
    """What a compiler says of one whole program.

    cycles        of the busiest unit, in the target's unit of cost
    issue         of the unit that issues instructions
    special       of the unit of logarithms, exponentials, roots and reciprocals
    instructions  all of them
    arithmetic    those of the vector or floating-point units, without the special ones
    specials      those of the special unit
    latency       cycles until one wave or thread alone is done; 0 where the compiler does not say
    registers     vector registers, or floating-point ones; 0 where the compiler does not say
    half_rate     of the arithmetic, those on a unit that takes twice as long, where a chip has one
    """

    cycles: float
    issue: float
    special: float
    instructions: float
    arithmetic: float
    specials: float
    latency: float
    registers: int
    half_rate: int = 0


@dataclass(frozen=True)
class Target(ABC):
    """A chip's family, and how machine code for it is made and counted; one subclass for each compiler.

    name        as users write it: rdna2
    chip        what its compiler calls it: NAVI21
    title       for people
    unit        of a cost: "cycles" (of a wave of 64, or of an element), or "slots" (of a warp's issue)
    tool        the compiler's name
    language    of LANGUAGES, what its compiler is given
    precisions  that it has units for
    model       whose schedule stands for the chip's, where its compiler has none of its own; "" otherwise
    """

    name: str
    chip: str
    title: str
    unit: str
    tool: str
    language: str
    precisions: tuple[str, ...] = ("float32",)
    model: str = ""

    @property
    @abstractmethod
    def family(self) -> str:
        """The module that compiles for it: radv, nvidia, clang_mca."""

    def calls(self, code: Code) -> int:
        """How often a program calls it."""
        return WITH_TABLE if code.has_table else UNROLLED

    @abstractmethod
    def why_not(self) -> str | None:
        """What is missing here to compile for it, with the package that brings it; None where nothing is."""

    @abstractmethod
    def tool_version(self) -> str:
        """The compiler's release; InputError where there is none."""

    @abstractmethod
    def counted(self, programs: Sequence[tuple[Code, int]], contexts: Sequence[int]) -> list[list[Counts]]:
        """What the compiler says of programs, each in every context.

        programs  a code, and how often its program calls it on vectors that change, adding its values up
        contexts  numbers of multiply-adds around each call
        Raises InputError, with the compiler's message, for code that it refuses.
        """

    def checked(self) -> "Target":
        """Itself; InputError, with the package that is missing, where it cannot compile here."""
        if (missing := self.why_not()) is not None:
            raise InputError(f"cannot compile for {self.name} here: {missing}", self.name, "shipped formulas need none")
        return self


class Gpu(Target):
    """A target on which multiply-adds only add to what is issued, so that one program tells of every context."""

    def counted(self, programs: Sequence[tuple[Code, int]], contexts: Sequence[int]) -> list[list[Counts]]:
        """By compiling each program alone."""
        found = self.compile([self.program(code, calls, 0) for code, calls in programs])
        return [
            [self.surrounded(counts, context * calls) for context in contexts]
            for counts, (_, calls) in zip(found, programs, strict=True)
        ]

    @abstractmethod
    def program(self, code: Code, calls: int, context: int) -> str:
        """A program that calls `highlight` of this code on vectors that change, and adds its values up.

        calls    of `highlight`
        context  multiply-adds around each of them
        """

    @abstractmethod
    def compile(self, programs: Sequence[str]) -> list[Counts]:
        """What the compiler says of each program; InputError, with the compiler's message, for one it refuses."""

    @abstractmethod
    def surrounded(self, counts: Counts, multiply_adds: int) -> Counts:
        """Counts of the same program with so many more multiply-adds."""
