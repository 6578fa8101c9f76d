"""NVIDIA's GPUs, by its run-time compiler and its disassembler: what a warp's instructions take of each unit.

Neither needs the chip. A multiprocessor has four schedulers, each of which issues one instruction of a warp of 32 a
cycle: a slot. Additions and products run at that rate, on sm75 at half of it; comparisons, minima, choices and logic at
half of it; logarithms, exponentials, roots, reciprocals and conversions at an eighth. Source: NVIDIA's CUDA programming
guide, throughput of native arithmetic instructions.
"""

import re
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32
from phongbench.formulas.shader_code.languages import CUDA
from phongbench.support.process import cores
from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import NAMES, indented, steps
from phongbench.targets.target import Counts, Gpu
from phongbench.targets.tools import answer

#: instructions of the units for arithmetic, for the special functions, and for neither; the others are comparisons,
#: choices and logic, on a unit of half the rate
_FLOATING = re.compile(r"F(?:ADD|MUL|FMA)|HFMA2|HADD2|HMUL2|IMAD")
_SPECIAL = re.compile(r"MUFU|[FI]2[FI]|FRND")
_ELSEWHERE = re.compile(r"LD|ST|S2|CS2R|U[A-Z]|R2U|BRA|EXIT|BSSY|BSYNC|RET|CALL|WARPSYNC")
_INSTRUCTION = re.compile(r"^\s+/\*[0-9a-f]+\*/\s+(?:@!?U?P\w+\s+)?([A-Z][A-Z0-9_]*)([^;]*)", re.MULTILINE)
_PROGRAM = re.compile(r"^\.text\.\w*?n(\d+)7program\w*:$", re.MULTILINE)
#: slots of a comparison, a choice or logic, and of a special instruction
_HALF_RATE, _SPECIAL_RATE = 2, 8
#: what no namespace may hold
_INCLUDE = re.compile(r"^#include .*$", re.MULTILINE)
#: the header of float16
_HEADER = "cuda_fp16.h"
#: programs that are compiled at a time
_TOGETHER = 24


@dataclass(frozen=True)
class Nvidia(Gpu):
    """An architecture of NVIDIA's.

    arithmetic_slots  that an addition or a product takes
    """

    arithmetic_slots: int = 1

    @property
    def family(self) -> str:
        """This module."""
        return "nvidia"

    def why_not(self) -> str | None:
        """The package that is missing, or None."""
        if any(_installed(file) is None for file in ("lib*/libnvrtc.so.*", "bin/nvdisasm", f"include/{_HEADER}")):
            return "pip install 'phongbench[targets]' brings NVIDIA's compiler and disassembler, on Linux"
        return None

    def tool_version(self) -> str:
        """The compiler's release and the disassembler's."""
        self.checked()
        return _versions()

    def program(self, code: Code, calls: int, context: int) -> str:
        """A kernel, one thread for each set of vectors."""
        names, numbers = NAMES[: code.vectors], CUDA.in_precision(code.precision)
        kind, number = ("half3", "__half") if code.precision == FLOAT16 else ("float3", "float")
        read = [f"float3 given_{name} = given[{code.vectors}u * i + {k}u];" for k, name in enumerate(names)]
        read += [f"{kind} {name} = {{{', '.join(f'given_{name}.{axis}' for axis in 'xyz')}}};" for name in names]
        body = steps(calls, code.vectors, context, "{} = moved({}, {}, {});", numbers)
        return "\n".join(
            [
                f'#line 1 "{code.name}"',
                _INCLUDE.sub("", code.text),
                *([_half_highlight(names)] if code.precision == FLOAT16 else ()),
                f"__device__ inline {kind} moved({kind} v, {number} k, {kind} w) {{",
                f"    return {kind}{{v.y * k + w.x, v.z * k + w.y, v.x * k + w.z}};",
                "}",
                "__global__ void program(const float3* __restrict__ given, float* __restrict__ found) {",
                indented(["unsigned i = blockIdx.x * 64 + threadIdx.x;", *read, *body, "found[i] = total;"]),
                "}",
            ]
        )

    def compile(self, programs: Sequence[str]) -> list[Counts]:
        """Each program by NVRTC and nvdisasm, several at a time."""
        self.checked()
        groups = [programs[i : i + _TOGETHER] for i in range(0, len(programs), _TOGETHER)]
        with ThreadPoolExecutor(cores()) as pool:
            texts = pool.map(lambda group: _assembly(group, self.chip), groups)
            return [self._counts(text) for together in texts for text in together]

    def surrounded(self, counts: Counts, multiply_adds: int) -> Counts:
        """Of the same program with more of them: they take issue and arithmetic, and nothing else."""
        n = counts.instructions + multiply_adds, counts.arithmetic + multiply_adds
        return self._limited(replace(counts, instructions=n[0], arithmetic=n[1]))

    def _counts(self, assembly: str) -> Counts:
        found = [match for match in _INSTRUCTION.findall(assembly) if match[0] != "NOP"]
        names = [name for name, _ in found]
        specials = sum(_SPECIAL.match(name) is not None for name in names)
        floating = sum(_FLOATING.match(name) is not None for name in names)
        elsewhere = sum(_ELSEWHERE.match(name) is not None for name in names)
        registers = [int(number) for _, operands in found for number in re.findall(r"\bR(\d+)", operands)]
        arithmetic = len(names) - specials - elsewhere
        return self._limited(
            Counts(
                cycles=0,
                issue=0,
                special=_SPECIAL_RATE * specials,
                instructions=len(names),
                arithmetic=arithmetic,
                specials=specials,
                latency=0,
                registers=1 + max(registers, default=0),
                half_rate=arithmetic - floating,
            )
        )

    def _limited(self, counts: Counts) -> Counts:
        """The slots that counted instructions take."""
        floating = counts.arithmetic - counts.half_rate
        units = counts.instructions, self.arithmetic_slots * floating, _HALF_RATE * counts.half_rate
        return replace(counts, issue=max(units), cycles=max(*units, counts.special))


_BOTH = FLOAT32, FLOAT16
TARGETS = (
    Nvidia("sm75", "sm_75", "NVIDIA Turing (RTX 20, T4)", "slots", "NVRTC", "cuda", _BOTH, arithmetic_slots=2),
    Nvidia("sm86", "sm_86", "NVIDIA Ampere (RTX 30)", "slots", "NVRTC", "cuda", _BOTH),
    Nvidia("sm89", "sm_89", "NVIDIA Ada (RTX 40)", "slots", "NVRTC", "cuda", _BOTH),
    Nvidia("sm90", "sm_90", "NVIDIA Hopper (H100)", "slots", "NVRTC", "cuda", _BOTH),
    Nvidia("sm120", "sm_120", "NVIDIA Blackwell (RTX 50)", "slots", "NVRTC", "cuda", _BOTH),
)


@cache
def _installed(pattern: str) -> Path | None:
    """A file of NVIDIA's packages, which share the folder `nvidia`."""
    spec = find_spec("nvidia")
    folders = (Path(folder) for folder in (spec and spec.submodule_search_locations) or ())
    return next((path for folder in folders for path in sorted(folder.glob(f"*/{pattern}"))), None)


def _nvrtc(chip: str = "", given: bytes = b"") -> bytes:
    """The machine code for a chip; without one, the compiler's version."""
    header = _installed(f"include/{_HEADER}")
    more = [chip, *([header.parent] if header else [])] if chip else []
    command = [sys.executable, "-m", "phongbench.targets.nvrtc", _installed("lib*/libnvrtc.so.*"), *more]
    return answer("NVRTC", command, given, chip=chip)[0]


def _half_highlight(names: Sequence[str]) -> str:
    """A vector of float16, and `highlight` of such."""
    taken = ", ".join(f"const half3& {name}" for name in names)
    passed = [f"const __half {name}_[3] = {{{', '.join(f'{name}.{axis}' for axis in 'xyz')}}};" for name in names]
    call = f"return highlight({', '.join(f'{name}_' for name in names)});"
    return "\n".join(
        [
            "struct half3 { __half x, y, z; };",
            f"__device__ inline __half highlight({taken}) {{",
            indented([*passed, call]),
            "}",
        ]
    )


def _nvdisasm(*options: object) -> str:
    return answer("nvdisasm", [_installed("bin/nvdisasm"), *options])[0].decode()


@cache
def _versions() -> str:
    disassembler = re.search(r"V([\d.]+)", _nvdisasm("--version"))
    return f"NVRTC {_nvrtc().decode()}, nvdisasm {disassembler[1] if disassembler else 'unknown'}"


def _assembly(programs: Sequence[str], chip: str) -> list[str]:
    """The machine code of programs that are compiled together, each in a namespace of its own."""
    spaces = [f"namespace n{i} {{\n{program}\n}}" for i, program in enumerate(programs)]
    source = "\n".join([*([f"#include <{_HEADER}>"] if any("__half" in one for one in programs) else []), *spaces])
    with tempfile.TemporaryDirectory(prefix="pb-nvidia-") as folder:
        file = Path(folder, "programs.cubin")
        file.write_bytes(_nvrtc(chip, source.encode()))
        parts = _PROGRAM.split(_nvdisasm("-c", file))
    found = dict(zip(map(int, parts[1::2]), parts[2::2], strict=True))
    return [found[i] for i in range(len(programs))]
