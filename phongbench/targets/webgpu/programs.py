"""Compute shaders around a formula's code: what is timed, and what evaluates it on given directions.

Timed programs follow `targets.harness`: the calls are unrolled by hand, since compilers bound loops and do not unroll
them, over vectors that change from call to call, and the values are added up. How they change is read from memory, so
that no compiler knows it: their components trade places, and so they keep their lengths for ever.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from phongbench.targets.code_shapes import Code
from phongbench.targets.harness import NAMES, indented

#: threads of a work group
GROUP = 64
#: calls of the shorter of the two programs of a formula; the longer one has LONGER times as many
CALLS, LONGER = 8, 4
#: calls where a table is copied for each, and multiply-adds of a program with few calls amid many of them
WITH_TABLE, FEW = 2, 64
#: variables that the multiply-adds around a call work on: enough that none waits for another
AROUND = 4
#: texels of the memory that a reading context reads from: a texture of 2048 by 2048, four bytes each
TEXELS = 1 << 22
#: work groups of a row of a dispatch, which may have at most 65535
ROW = 1 << 15

#: what every program is given; data holds three vectors a thread, settings how often calls are repeated
_BINDINGS = """\
struct Settings { repeats: u32, threads: u32, mask: u32, spare: u32, factor: vec4f, summand: vec4f }
@group(0) @binding(0) var<storage, read> given: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;
@group(0) @binding(2) var<uniform> settings: Settings;
@group(0) @binding(3) var<storage, read> texels: array<u32>;
"""
_MAIN = f"""\
@compute @workgroup_size({GROUP})
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let i = id.x + id.y * {ROW * GROUP}u;
"""


@dataclass(frozen=True, slots=True)
class Context:
    """What a shader does around each highlight.

    multiply_adds  of other work
    reads          bytes that it reads from memory of a texture's size, 0 or 4
    """

    multiply_adds: int = 0
    reads: int = 0

    def calls(self, code: Code) -> int:
        """Calls of the shorter program."""
        most = WITH_TABLE if code.has_table else CALLS
        return min(most, max(1, FEW // self.multiply_adds)) if self.multiply_adds else most


#: costs are quoted in the first
CONTEXTS = (Context(), Context(8), Context(32), Context(128), Context(0, 4))


def timed(code: Code, calls: int, context: Context) -> str:
    """A program that calls `highlight` so often, again and again, on vectors that change, and adds its values up."""
    names = NAMES[: code.vectors]
    start = [f"var {name} = given[3u * i + {k}u].xyz;" for k, name in enumerate(names)]
    start += ["let factor = settings.factor;", "let summand = settings.summand;", "var total = 0.0;"]
    around = [f"t{i}" for i in range(AROUND)] if context.multiply_adds else []
    start += [f"var {name} = {names[i % len(names)]}.{'xyz'[i % 3]};" for i, name in enumerate(around)]
    start += ["var at = i;"] if context.reads else []
    kept = [f"{name}.{axis}" for name in names for axis in "xyz"] + around
    body = _calls(names, calls, context)
    loop = ["for (var k = 0u; k < settings.repeats; k++) {", *(f"    {line}" for line in body), "}"]
    return "\n".join(
        [code.text, _BINDINGS, _MAIN, indented([*start, *loop, f"results[i] = total + {' + '.join(kept)};"]), "}"]
    )


def _calls(names: Sequence[str], calls: int, context: Context) -> list[str]:
    """The statements of one turn of the loop."""
    lines: list[str] = []
    for _ in range(calls):
        lines += [f"{name} = {name}.yzx * factor.xyz + summand.xyz;" for name in names]  # or some work is done once
        lines.append(f"total += highlight({', '.join(names)});")
        if context.reads:  # neighbours read neighbours, and each call another part of the whole
            lines.append("at = (at + 16411u) & settings.mask;")
            lines.append("total += f32(texels[at]);")
        lines += [f"t{i % AROUND} = t{i % AROUND} * factor.w + summand.w;" for i in range(context.multiply_adds)]
    return lines


def copying() -> str:
    """A program that copies 16 bytes a thread: what memory can do at best."""
    binding = "@group(0) @binding(1) var<storage, read_write> results: array<vec4f>;"
    bindings = _BINDINGS.replace("@group(0) @binding(1) var<storage, read_write> results: array<f32>;", binding)
    return f"{bindings}\n{_MAIN}    results[i] = given[i];\n}}"


def evaluating(code: Code, half: bool) -> str:
    """A program that calls `highlight` once for each thread's vectors and keeps its value.

    half  whether it takes and gives numbers of 16 bits; all that is given fits them, so no rounding comes in
    """
    names = NAMES[: code.vectors]
    kind = "vec3h({})" if half else "{}"
    taken = ", ".join(kind.format(f"given[3u * i + {k}u].xyz") for k in range(len(names)))
    guard = "    if (i >= settings.threads) { return; }"
    return "\n".join([code.text, _BINDINGS, _MAIN, guard, f"    results[i] = f32(highlight({taken}));", "}"])
