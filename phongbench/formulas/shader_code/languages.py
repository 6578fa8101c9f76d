"""The languages a formula can be written in: how each spells numbers, types, functions, tables and choices."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from phongbench.errors import UnknownNameError

#: functions that every language has
_BUILT_IN = """
    abs acos ceil clamp exp exp2 floor inverseSqrt inversesqrt length limited log log2 max min mix normalize pow
    reflect round rsqrt saturate select sign sqrt
"""
BUILT_IN = frozenset(_BUILT_IN.split())
#: words of GLSL, HLSL, WGSL, C and C++ that a kernel's author may well have taken for a name
_TAKEN = """
    active alignas alignof array asm atomic auto bool break buffer case cast catch centroid char class coherent
    column_major common compile const constexpr continue convert default delete demote discard do double dword
    else enum explicit export extern external false far filter final fixed flat float for fragment friend from
    get global goto half if import in inline inout input int interface invariant layout let line lineadj linear
    long lowp matrix mediump meta module move mut namespace near new noinline none null of operator out output
    override packed partition pass patch pixelfragment point precise precision premerge priv private protected
    public readonly ref register require resource restrict return row_major sample sampler self set shared short
    signed sizeof smooth snorm stateblock static string struct subroutine super superp switch table target
    technique template texture this throw triangle true try type typedef typeid typename union uniform unless
    unorm unsigned use using var varying vector virtual void volatile wgsl where while with write yield
"""
RESERVED = frozenset(_TAKEN.split())


def _braced(header: str, lines: list[str]) -> str:
    return "\n".join([f"{header} {{", *(f"    {line}" for line in lines), "}"])


@dataclass(frozen=True)
class Language:
    """How one language writes scalar float32 code.

    name          for the command line; the suffix of a file of it, too
    float_type    a 32-bit float; integers likewise
    direction     type and name of an argument that is a direction; {} is the name
    literal       shortest decimal text of a float32 -> its literal
    declared      (type, name, expression) -> a statement that makes a variable, which may change later
    header        (result type, name, arguments as (type, name)) -> what stands before a function's brace
    chosen        (condition, where true, where false) -> an expression, all three given in brackets where needed
    listed        (name, values as literals) -> statement of a constant table
    names         of built-in functions, where they differ from GLSL's
    helpers       name -> text of a function that the language lacks, put in front where it is called
    preamble      what stands above all functions
    components    a direction's components, where the language has no dot and cross of its own; else None
    gpu           it runs on GPUs, which flush subnormal numbers and have minima, maxima and limits as instructions
    saturated     an expression -> the same limited to 0..1, on GPUs
    returned      an expression -> the statement that returns it
    function      (header, statements) -> a function
    """

    name: str
    float_type: str
    integer_type: str
    direction: tuple[str, str]
    literal: Callable[[str], str]
    declared: Callable[[str, str, str], str]
    header: Callable[[str, str, list[tuple[str, str]]], str]
    chosen: Callable[[str, str, str], str]
    listed: Callable[[str, list[str]], str]
    names: Mapping[str, str] = field(default_factory=dict)
    helpers: Mapping[str, str] = field(default_factory=dict)
    preamble: str = ""
    components: tuple[str, str, str] | None = None
    gpu: bool = True
    saturated: Callable[[str], str] = "clamp({}, 0.0, 1.0)".format
    returned: Callable[[str], str] = "return {};".format
    function: Callable[[str, list[str]], str] = _braced

    def number(self, value: float) -> str:
        """The float32 nearest to the value, in the fewest digits that give it back."""
        return self.literal(str(np.float32(value)))

    def word(self, name: str) -> str:
        """The name, changed where the language, or another of them, has taken it."""
        return f"{name}_" if name in RESERVED or name.startswith("gl_") else name.replace("__", "_")


def _c_declared(kind: str, name: str, value: str) -> str:
    return f"{kind} {name} = {value};"


def _c_header(kind: str, name: str, arguments: list[tuple[str, str]]) -> str:
    return f"{kind} {name}({', '.join(f'{k} {n}' for k, n in arguments)})"


def _c_chosen(condition: str, yes: str, no: str) -> str:
    return f"{condition} ? {yes} : {no}"


def _c_listed(name: str, values: list[str]) -> str:
    return f"static const float {name}[{len(values)}] = {{{', '.join(values)}}};"


GLSL = Language(
    "glsl", "float", "int", ("vec3", "{}"),
    literal=str, declared=_c_declared, header=_c_header, chosen=_c_chosen,
    listed=lambda name, values: f"const float {name}[{len(values)}] = float[{len(values)}]({', '.join(values)});",
    names={"float_bits": "floatBitsToInt", "bits_float": "intBitsToFloat", "round": "roundEven"},
)  # fmt: skip

HLSL = Language(
    "hlsl", "float", "int", ("float3", "{}"),
    literal=str, declared=_c_declared, header=_c_header, chosen=_c_chosen, listed=_c_listed,
    names={"float_bits": "asint", "bits_float": "asfloat", "inversesqrt": "rsqrt"},
    saturated="saturate({})".format,
)  # fmt: skip

WGSL = Language(
    "wgsl", "f32", "i32", ("vec3f", "{}"),
    literal=str,
    declared=lambda kind, name, value: f"var {name}: {kind} = {value};",
    header=lambda kind, name, arguments: (
        f"fn {name}({', '.join(f'{n}: {k}' for k, n in arguments)}) -> {kind}"
    ),
    chosen=lambda condition, yes, no: f"select({no}, {yes}, {condition})",
    listed=lambda name, values: (
        f"var<private> {name}: array<f32, {len(values)}> = array<f32, {len(values)}>({', '.join(values)});"
    ),
    names={
        "float_bits": "bitcast<i32>", "bits_float": "bitcast<f32>", "float": "f32", "int": "i32",
        "inversesqrt": "inverseSqrt",
    },
    saturated="saturate({})".format,
)  # fmt: skip

C = Language(
    "c", "float", "int", ("const float", "{}[3]"),
    literal=lambda text: f"{text}f", declared=_c_declared,
    header=lambda kind, name, arguments: f"static inline {_c_header(kind, name, arguments)}",
    chosen=_c_chosen, listed=_c_listed,
    names={
        "abs": "fabsf", "acos": "acosf", "exp": "expf", "exp2": "exp2f", "floor": "floorf", "float": "(float)",
        "int": "(int)", "log2": "log2f", "max": "fmaxf", "min": "fminf", "pow": "powf", "round": "rintf",
        "sqrt": "sqrtf",
    },
    helpers={
        "float_bits": "static inline int float_bits(float x) {\n    int bits;\n    memcpy(&bits, &x, sizeof bits);\n"
        "    return bits;\n}",
        "bits_float": "static inline float bits_float(int bits) {\n    float x;\n    memcpy(&x, &bits, sizeof x);\n"
        "    return x;\n}",
        "clamp": "static inline float clamp(float x, float low, float high) {\n"
        "    return x > low ? (x < high ? x : high) : low;\n}",
    },
    preamble="#include <math.h>\n#include <string.h>",
    components=("[0]", "[1]", "[2]"),
    gpu=False,
)  # fmt: skip

CUDA = Language(
    "cuda", "float", "int", ("float3", "{}"),
    literal=lambda text: f"{text}f", declared=_c_declared,
    header=lambda kind, name, arguments: f"static __device__ inline {_c_header(kind, name, arguments)}",
    chosen=_c_chosen, listed=lambda name, values: _c_listed(name, values).replace("static", "static __device__"),
    names={
        **C.names, "float_bits": "__float_as_int", "bits_float": "__int_as_float", "inversesqrt": "rsqrtf",
        "clamp": "limited", "log2": "__log2f", "pow": "__powf",
    },
    helpers={
        "clamp": "static __device__ inline float limited(float x, float low, float high) {\n"
        "    return fminf(fmaxf(x, low), high);\n}",
    },
    components=(".x", ".y", ".z"),
    saturated="__saturatef({})".format,
)  # fmt: skip

LANGUAGES = {language.name: language for language in (GLSL, HLSL, WGSL, C, CUDA)}


def language_named(name: str) -> Language:
    """The language of this name; UnknownNameError lists those there are."""
    if name not in LANGUAGES:
        raise UnknownNameError("language", name, LANGUAGES, "language")
    return LANGUAGES[name]
