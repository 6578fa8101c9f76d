"""AMD's GPUs, by Mesa's RADV: its compiler works without the chip, on a null device, and says what its code costs."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from phongbench.errors import InputError
from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32
from phongbench.formulas.shader_code.languages import GLSL
from phongbench.support.process import cores
from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import NAMES, indented, steps
from phongbench.targets.target import Counts, Gpu

#: where the loader looks for drivers, and the name of RADV's manifest
_MANIFESTS = (Path("/usr/share/vulkan/icd.d"), Path("/usr/local/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))
_MANIFEST = "radeon_icd*.json"
_SPECIAL = re.compile(r"v_(?:exp|log|rcp|rsq|sqrt|sin|cos)_f\d+")
#: an instruction of the vector units, and how often it stands there again, as the disassembler abbreviates it
_VECTOR = re.compile(r"^\t(v_\w+).*\n(?:\t\(then repeated (\d+) times\))?", re.MULTILINE)
#: what must stand before everything else
_EXTENSION = re.compile(r"^#extension .*$", re.MULTILINE)
#: seconds that a program of a hundred may take; a driver that hangs is no reason to wait for ever
_PATIENCE = 600


@dataclass(frozen=True)
class Radv(Gpu):
    """An AMD GPU.

    issue_cycles, special_cycles   that an instruction takes of the unit that issues it, a wave of 64: arithmetic's,
                                   and the special ones'
    special_unit                   cycles that a special instruction takes of a unit beside, 0 where there is none
    """

    issue_cycles: int = 2
    special_cycles: int = 2
    special_unit: int = 8

    @property
    def family(self) -> str:
        """This module."""
        return "radv"

    def surrounded(self, counts: Counts, multiply_adds: int) -> Counts:
        """Of the same program with more of them: they only add to what is issued."""
        more = self.issue_cycles * multiply_adds
        issue = counts.issue if counts.special > counts.issue else counts.cycles
        return replace(
            counts,
            cycles=max(issue + more, counts.special),
            issue=counts.issue + more,
            instructions=counts.instructions + multiply_adds,
            arithmetic=counts.arithmetic + multiply_adds,
        )

    def why_not(self) -> str | None:
        """The package that is missing, or None."""
        if find_spec("vulkan") is None:
            return "pip install 'phongbench[targets]' brings Vulkan's binding"
        if shutil.which("glslangValidator") is None:
            return "there is no glslangValidator; apt's glslang-tools brings it"
        if _manifest() is None:
            return "there is no RADV; apt's mesa-vulkan-drivers brings it"
        return None

    def tool_version(self) -> str:
        """Mesa's release and glslang's."""
        return _versions(self.chip)

    def program(self, code: Code, calls: int, context: int) -> str:
        """A compute shader, one thread for each set of vectors."""
        names, numbers = NAMES[: code.vectors], GLSL.in_precision(code.precision)
        kind = numbers.direction[0]
        read = [f"{kind} {name} = {kind}(given[{code.vectors}u * i + {k}u].xyz);" for k, name in enumerate(names)]
        body = steps(calls, code.vectors, context, "{} = {}.yzx * {} + {};", numbers)
        return "\n".join(
            [
                "#version 450",
                *_EXTENSION.findall(code.text),
                "layout(local_size_x = 64) in;",
                "layout(std430, binding = 0) readonly buffer Given { vec4 given[]; };",
                "layout(std430, binding = 1) writeonly buffer Found { float found[]; };",
                _EXTENSION.sub("", code.text),
                "void main() {",
                indented(["uint i = gl_GlobalInvocationID.x;", *read, *body, "found[i] = float(total);"]),
                "}",
            ]
        )

    def compile(self, programs: Sequence[str]) -> list[Counts]:
        """Each program by glslang and RADV."""
        self.checked()
        with tempfile.TemporaryDirectory(prefix="pb-radv-") as folder:
            files = [Path(folder, f"{i}.spv") for i in range(len(programs))]
            share = max(1, -(-len(files) // cores()))
            with ThreadPoolExecutor(cores()) as pool:
                list(pool.map(lambda pair: pair[0].write_bytes(spirv(pair[1])), zip(files, programs, strict=True)))
                shares = [[str(file) for file in files[i : i + share]] for i in range(0, len(files), share)]
                answers = [one for found in pool.map(partial(_on_null_device, self.chip), shares) for one in found]
        return [self._counts(answer) for answer in answers]

    def _counts(self, answer: dict[str, Any]) -> Counts:
        told, vector = answer["statistics"], _VECTOR.findall(answer["assembly"])
        specials = sum(1 + int(again or 0) for name, again in vector if _SPECIAL.match(name))
        arithmetic = sum(1 + int(again or 0) for _, again in vector) - specials
        issue = self.issue_cycles * arithmetic + self.special_cycles * specials
        return Counts(
            cycles=told["Inverse Throughput"],
            issue=issue,
            special=specials * (self.special_unit or self.special_cycles),
            instructions=told["Instructions"],
            arithmetic=arithmetic,
            specials=specials,
            latency=told["Latency"],
            registers=told["VGPRs"],
        )


#: the driver offers float16 from GCN 5 on
_BOTH = FLOAT32, FLOAT16
TARGETS = (
    Radv(
        "gcn4", "POLARIS10", "AMD GCN 4 (Polaris)", "cycles", "RADV", "glsl",
        issue_cycles=4, special_cycles=16, special_unit=0,
    ),
    Radv(
        "gcn5", "VEGA10", "AMD GCN 5 (Vega)", "cycles", "RADV", "glsl", _BOTH,
        issue_cycles=4, special_cycles=16, special_unit=0,
    ),
    Radv("rdna2", "NAVI21", "AMD RDNA 2", "cycles", "RADV", "glsl", _BOTH),
    Radv("rdna3", "GFX1100", "AMD RDNA 3", "cycles", "RADV", "glsl", _BOTH),
)  # fmt: skip


@cache
def spirv(program: str) -> bytes:
    """A compute shader in GLSL as SPIR-V; InputError, with glslang's first complaint, where it is none."""
    with tempfile.TemporaryDirectory(prefix="pb-glslang-") as folder:
        source, out = Path(folder, "program.comp"), Path(folder, "program.spv")
        source.write_text(program)
        command = ["glslangValidator", "-V", "--target-env", "vulkan1.2", str(source), "-o", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise InputError(f"glslang refuses the code: {_complaint(done.stdout)}", None, "see `phongbench shader`")
        return out.read_bytes()


def _complaint(output: str) -> str:
    lines = [line for line in output.splitlines() if line.startswith("ERROR")]
    return re.sub(r"\S*program\.comp:", "line ", lines[0].removeprefix("ERROR: ")) if lines else "it says nothing"


def _manifest() -> Path | None:
    found = (path for folder in _MANIFESTS if folder.is_dir() for path in sorted(folder.glob(_MANIFEST)))
    return next(found, None)


def _on_null_device(chip: str, files: list[str]) -> list[dict[str, Any]]:
    """What RADV says of SPIR-V files, in a process of its own: a driver that crashes takes nothing with it."""
    environment = os.environ | {
        "RADV_FORCE_FAMILY": chip,
        "VK_ICD_FILENAMES": str(_manifest()),
        "VK_DRIVER_FILES": str(_manifest()),
        "MESA_SHADER_CACHE_DISABLE": "true",
    }
    command = [sys.executable, "-m", "phongbench.targets.null_device"]
    try:
        done = subprocess.run(
            command, input=json.dumps(files), capture_output=True, text=True, check=False, timeout=_PATIENCE,
            env=environment,
        )  # fmt: skip
    except subprocess.TimeoutExpired as problem:
        raise InputError(f"RADV did not answer for {chip} in {_PATIENCE} s", None, "try another Mesa") from problem
    if done.returncode:
        words = done.stderr.strip().splitlines()[-1:] or [f"exit {done.returncode}"]
        raise InputError(f"RADV failed for {chip}: {words[0]}", None, "try another Mesa; other targets go on")
    answers: list[dict[str, Any]] = json.loads(done.stdout)
    return answers


@cache
def _versions(chip: str) -> str:
    done = subprocess.run(["glslangValidator", "--version"], capture_output=True, text=True, check=False)
    glslang = re.search(r"Glslang Version: \d+:([\d.]+)", done.stdout)
    driver = _on_null_device(chip, [])[0]["driver"]
    return f"Mesa {driver}, glslang {glslang[1] if glslang else 'unknown'}"
