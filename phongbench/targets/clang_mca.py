"""Processors and microcontrollers, by clang and llvm-mca: what a loop over elements takes of a core's units.

The C that `shader` writes is compiled for the core, with vectors where it has them, and llvm-mca's model of the core
says how many cycles an iteration takes at least: of its busiest unit, or of issuing. What waits for what is left out,
as in a loop whose iterations overlap. Powers, exponentials and arc cosines are phongbench's own polynomials, in
`processor.h`, since calls of a library have no schedule and keep loops scalar.
"""

import re
import shutil
from bisect import bisect_right
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from phongbench.compiler.polynomials import ARC_32, EXP2, LOG2_RATIO
from phongbench.errors import InputError
from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32
from phongbench.formulas.shader_code.languages import C
from phongbench.support.process import cores
from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import NAMES, indented, steps
from phongbench.targets.target import Counts, Target
from phongbench.targets.tools import answer

#: releases of LLVM that are looked for; Debian's programs carry theirs
_RELEASES = ("-19", "")
#: as the kernels are compiled: multiply-adds are contracted, nothing else is changed
_CLANG = (
    "-x", "c++", "-std=c++20", "-O3", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-fno-exceptions",
    "-ffreestanding", "-fno-asynchronous-unwind-tables", "-w", "-S", "-o", "-", "-", "-Rpass=loop-vectorize",
    "-mllvm", "-inline-threshold=1000000",
)  # fmt: skip
_MCA = ("-iterations=1", "-all-views=false", "-summary-view", "-skip-unsupported-instructions=lack-sched")
_HEADER = Path(__file__).with_name("processor.h")
_COEFFICIENTS = {"LOG2_RATIO": LOG2_RATIO, "EXP2": EXP2, "ARC": ARC_32}
_FUNCTION = re.compile(r"^_ZN\d+n(\d+)7programE(?:f|DF16_):", re.MULTILINE)
_VECTORISED = re.compile(r"^<stdin>:(\d+):\d+: remark: vectorized loop \(vectorization width: (\d+)", re.MULTILINE)
_LABEL = re.compile(r"(\.LBB\d+_\d+):")
_INSTRUCTION = re.compile(r"\t([a-z]\S*)")
_SPECIAL = re.compile(r"v?f?(?:div|sqrt|rsqrt|rcp)(?:14|e|s)?(?:[ps][sh]|\.f32|\.f16)?$|frecp")
_MOVES = re.compile(r"v?(?:mov|ld|st|push|dup|broadcast|pbroadcast)")
_CALL = re.compile(r"callq?$|blx?$")
_REGISTER = re.compile(r"\b(?:[xyz]mm|[vqsdh])(\d+)\b")
#: what a model does not know, and what costs as much in its place: a comparison with zero, and one that signals; and
#: integers made float16, at which llvm-mca 19 hangs: they take the two operations that numbers of 32 bits take
_UNKNOWN = (
    (re.compile(r"\tvcmpe?\.f(32|16)\t(s\d+), \S+"), r"\tvcmp.f\1\t\2, s0"),
    (re.compile(r"\tvcvtdq2ph\t"), r"\tvcvtps2phx\t"),
)
_REGION = re.compile(r"Code Region - r(\d+)$.*?^Block RThroughput: ([\d.]+)", re.MULTILINE | re.DOTALL)
#: of Thumb, which issues as a part of what it makes conditional
_FOLDED = re.compile(r"it[te]*$")
_FIX = "see `phongbench shader`"
#: programs that are compiled at a time
_TOGETHER = 24
#: calls in an iteration: more would need more registers than there are
_UNROLLED = 4


@dataclass(frozen=True)
class Processor(Target):
    """A core.

    triple        of its machine code, for LLVM
    multiply_add  an instruction of it: of vectors, and of numbers alone; of float16 likewise, where it has that
    width         elements in a vector; 1 where there are none
    divider       cycles that a division or a root keeps its unit, where the model forgets it: as long as they take; 0
                  where it does not
    options       for clang, where the model is wrong of what it would choose
    """

    triple: str = ""
    multiply_add: tuple[str, str] = ("", "")
    half_multiply_add: tuple[str, str] = ("", "")
    width: int = 4
    divider: int = 0
    options: tuple[str, ...] = ()

    @property
    def family(self) -> str:
        """This module."""
        return "clang_mca"

    def calls(self, code: Code) -> int:
        """As many as registers allow."""
        return _UNROLLED

    def why_not(self) -> str | None:
        """The package that is missing, or None."""
        lacking = next((name for name in ("clang", "llvm-mca") if _tool(name) is None), None)
        return lacking and f"there is no {lacking}; apt's clang-19 and llvm-19 bring it"

    def tool_version(self) -> str:
        """LLVM's release."""
        self.checked()
        return _version()

    def program(self, code: Code, calls: int) -> str:
        """A loop, an element an iteration or as many as a vector holds."""
        names, numbers = NAMES[: code.vectors], C.in_precision(code.precision)
        number = numbers.float_type
        read = [
            f"vec3<{number}> {name} = {{{{{', '.join(f'given<{number}>[{3 * k + axis}][i]' for axis in range(3))}}}}};"
            for k, name in enumerate(names)
        ]
        body = steps(calls, code.vectors, 0, "{0} = moved({1}, k, {3});", numbers)
        return "\n".join(
            [
                re.sub(r"^#include.*\n", "", code.text, flags=re.MULTILINE),
                f"static inline {number} highlight({', '.join(f'vec3<{number}> {name}' for name in names)}) {{",
                f"    return highlight({', '.join(f'{name}.v' for name in names)});",
                "}",
                f"void program({number} k) {{",
                f"#pragma clang loop vectorize_width({self._width(code)}) interleave_count(1) unroll(disable)",
                "    for (int i = 0; i < 64; i++) {",
                indented([*read, *body, f"found<{number}>[i] = total;"], 2),
                "    }",
                "}",
            ]
        )

    def _width(self, code: Code) -> int:
        """Elements of a vector, of which there are twice as many in float16."""
        return self.width * (2 if code.precision == FLOAT16 and self.width > 1 else 1)

    def counted(self, programs: Sequence[tuple[Code, int]], contexts: Sequence[int]) -> list[list[Counts]]:
        """Each program by clang, and its loop by llvm-mca, with multiply-adds after it for every context."""
        groups = [programs[i : i + _TOGETHER] for i in range(0, len(programs), _TOGETHER)]
        with ThreadPoolExecutor(cores()) as pool:
            found = pool.map(lambda group: self._together(group, contexts), groups)
            return [counts for together in found for counts in together]

    def _together(self, programs: Sequence[tuple[Code, int]], contexts: Sequence[int]) -> list[list[Counts]]:
        regions: list[list[str]] = []
        loops = self._loops([self.program(*pair) for pair in programs])
        for loop, (code, calls) in zip(loops, programs, strict=True):
            adds = self.half_multiply_add if code.precision == FLOAT16 else self.multiply_add
            add = adds[loop.width == 1]
            regions += [loop.text(special=False), loop.text(special=True)]
            regions += [[*loop.text(), *[add] * (context * calls)] for context in contexts]
        told, each = self._schedule(regions), 2 + len(contexts)
        found = [told[i : i + each] for i in range(0, len(told), each)]
        return [
            [loop.counts(issue, max(special, self.divider * loop.specials), cycles) for cycles in whole]
            for loop, (issue, special, *whole) in zip(loops, found, strict=True)
        ]

    def _schedule(self, regions: Sequence[Sequence[str]]) -> list[float]:
        """Cycles that one iteration of each region takes at least; 0 where it is empty."""
        marked = [
            "\n".join([f"# LLVM-MCA-BEGIN r{i}", *lines, f"# LLVM-MCA-END r{i}", ""])
            for i, lines in enumerate(regions)
            if lines
        ]
        told, said = _run("llvm-mca", [f"-mtriple={self.triple}", f"-mcpu={self.chip}", *_MCA], "".join(marked))
        unknown = sorted({line.split()[2] for line in said.splitlines() if line.startswith("note: instruction:")})
        if lacking := [name for name in unknown if not _FOLDED.match(name)]:
            raise InputError(f"llvm-mca has no schedule for {lacking[0]} on {self.name}", None, _FIX)
        found = {int(i): float(cycles) for i, cycles in _REGION.findall(told)}
        return [found.get(i, 0.0) for i in range(len(regions))]

    def _loops(self, programs: Sequence[str]) -> list["Loop"]:
        """The loops of programs that are compiled together, each in a namespace of its own."""
        lines, starts = _prelude().splitlines(), []
        for i, program in enumerate(programs):
            starts.append(len(lines))
            lines += [f"namespace n{i} {{", *program.splitlines(), "}"]
        kind = "-march" if self.triple.startswith("x86") else "-mcpu"
        given = [f"--target={self.triple}", f"{kind}={self.chip}", *self.options, *_CLANG]
        text, said = _run("clang", given, "\n".join(lines), self.name)
        widths = {bisect_right(starts, int(line) - 1) - 1: int(width) for line, width in _VECTORISED.findall(said)}
        pieces = _FUNCTION.split(text)
        functions = dict(zip(map(int, pieces[1::2]), pieces[2::2], strict=True))
        return [Loop.of(functions[i], widths.get(i, 1)) for i in range(len(programs))]


@dataclass(frozen=True)
class Loop:
    """The instructions of a loop.

    width  elements that an iteration is for
    lines  (name, text) of each instruction, but the one that closes the loop
    """

    width: int
    lines: list[tuple[str, str]]

    @classmethod
    def of(cls, function: str, width: int) -> "Loop":
        """The only loop of a function, from its label to the branch back to it. What branches skip counts too."""
        lines = function.splitlines()
        labels = {match[1]: i for i, line in enumerate(lines) if (match := _LABEL.match(line))}
        back = [
            (labels[word], i)
            for i, line in enumerate(lines)
            if line.startswith("\t") and (word := line.split()[-1]) in labels and labels[word] < i
        ]
        start, end = min(back)[0], max(i for _, i in back)
        found = [(match[1], line) for line in lines[start + 1 : end] if (match := _INSTRUCTION.match(line))]
        called = [line.split()[-1] for name, line in found if _CALL.match(name)]
        if called:
            raise InputError(f"a call of {called[0]} has no schedule", None, _FIX)
        return cls(width, found)

    def text(self, *, special: bool | None = None) -> list[str]:
        """All instructions, or those of the special unit, or the others."""
        found = "\n".join(line for name, line in self.lines if special in (None, _SPECIAL.match(name) is not None))
        for unknown, instead in _UNKNOWN:
            found = unknown.sub(instead, found)
        return found.splitlines()

    @property
    def specials(self) -> int:
        """How many instructions are divisions, roots and their estimates."""
        return sum(_SPECIAL.match(name) is not None for name, _ in self.lines)

    def counts(self, issue: float, special: float, cycles: float) -> Counts:
        """For an element, from the cycles of the instructions but the special ones, of these, and of all."""
        computing = sum(_REGISTER.search(line) is not None and not _MOVES.match(name) for name, line in self.lines)
        return Counts(
            cycles=max(cycles, special) / self.width,
            issue=issue / self.width,
            special=special / self.width,
            instructions=len(self.lines) / self.width,
            arithmetic=(computing - self.specials) / self.width,
            specials=self.specials / self.width,
            latency=0,
            registers=len({number for _, line in self.lines for number in _REGISTER.findall(line)}),
        )


_TOOL = "cycles", "clang and llvm-mca", "c"
_A64, _M7, _M55, _X86 = (
    "aarch64-none-elf", "thumbv7em-none-eabihf", "thumbv8.1m.main-none-eabihf", "x86_64-unknown-linux-gnu",
)  # fmt: skip
_NEON = "fmla v0.4s, v1.4s, v2.4s", "fmadd s0, s1, s2, s0"
_NEON_16 = "fmla v0.8h, v1.8h, v2.8h", "fmadd h0, h1, h2, h0"
_SCALAR = "vfma.f32 s0, s1, s2"
_AVX = "vfmadd213ps %{0}mm1, %{0}mm2, %{0}mm0", "vfmadd213ss %xmm1, %xmm2, %xmm0"
_BOTH = FLOAT32, FLOAT16
TARGETS = (
    Processor(
        "cortex-a55", "cortex-a55", "Arm Cortex-A55, Neon", *_TOOL, _BOTH, triple=_A64, multiply_add=_NEON,
        half_multiply_add=_NEON_16,
    ),
    Processor(
        "cortex-a76", "neoverse-n1", "Arm Cortex-A76, Neon", *_TOOL, _BOTH, model="Neoverse N1", triple=_A64,
        multiply_add=_NEON, half_multiply_add=_NEON_16,
    ),
    Processor(
        "cortex-m7", "cortex-m7", "Arm Cortex-M7", *_TOOL, triple=_M7, multiply_add=(_SCALAR, _SCALAR), width=1,
        divider=16,
    ),
    Processor(
        "cortex-m55", "cortex-m55", "Arm Cortex-M55, Helium", *_TOOL, _BOTH, triple=_M55,
        multiply_add=("vfma.f32 q0, q1, q2", _SCALAR), divider=16,
        half_multiply_add=("vfma.f16 q0, q1, q2", "vfma.f16 s0, s1, s2"),
    ),
    Processor(
        "zen4", "znver4", "AMD Zen 4, vectors of 512 bits", *_TOOL, triple=_X86,
        multiply_add=(_AVX[0].format("z"), _AVX[1]), width=16,
        options=("-mno-gather",),  # LLVM 19 takes a gather for a plain load
    ),
    Processor(
        "sapphire-rapids", "sapphirerapids", "Intel Sapphire Rapids, vectors of 256 bits", *_TOOL, _BOTH, triple=_X86,
        multiply_add=(_AVX[0].format("y"), _AVX[1]), width=8,
        half_multiply_add=("vfmadd213ph %ymm1, %ymm2, %ymm0", "vfmadd213sh %xmm1, %xmm2, %xmm0"),
    ),
)  # fmt: skip


@cache
def _prelude() -> str:
    """The functions that every program may call, with their coefficients."""
    arrays = [
        f"static const float {name}[] = {{{', '.join(f'{np.float32(c)}f' for c in values)}}};"
        for name, values in _COEFFICIENTS.items()
    ]
    return "\n".join([*arrays, _HEADER.read_text()])


def _tool(name: str) -> str | None:
    return next((path for release in _RELEASES if (path := shutil.which(name + release))), None)


@cache
def _version() -> str:
    told = (_run(name, ["--version"])[0] for name in ("clang", "llvm-mca"))
    found = [re.search(r"version ([\d.]+)", text) for text in told]
    return "clang {}, llvm-mca {}".format(*(match[1] if match else "unknown" for match in found))


def _run(name: str, options: Sequence[str], given: str = "", chip: str = "") -> tuple[str, str]:
    written, said = answer(name, [_tool(name), *options], given.encode(), chip=chip)
    return written.decode(), said
