"""The languages a formula can be written in: how each spells numbers, types, functions, tables and choices."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from phongbench.errors import UnknownNameError
from phongbench.formulas.shader_code.language import (
    FLOAT16,
    MEDIUMP,
    Language,
    c_chosen,
    c_declared,
    c_header,
    c_listed,
    glsl_listed,
)

#: tricks that read a float32's bits, which a shorter float has not
_NO_BITS: Mapping[str, str] = MappingProxyType(
    {"float_bits": "float32 whose bits could be read", "bits_float": "float32 whose bits could be written"}
)
_PRECISION_LINES = "the precision lines hold for all that follows them"
_MEDIUMP: Mapping[str, Mapping[str, Any]] = {
    MEDIUMP: {"preamble": "precision mediump float;\nprecision highp int;", "lacks": _NO_BITS, "note": _PRECISION_LINES}
}

GLSL = Language(
    "glsl", "float", "int", ("vec3", "{}"), suffixes=("frag", "vert", "comp"),
    literal=str, declared=c_declared, header=c_header, chosen=c_chosen, listed=glsl_listed,
    names={"float_bits": "floatBitsToInt", "bits_float": "intBitsToFloat", "round": "roundEven"},
    precisions={
        **_MEDIUMP,
        FLOAT16: {
            "float_type": "float16_t", "direction": ("f16vec3", "{}"), "literal": "{}hf".format,
            "preamble": "#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require",
            "names": {"round": "roundEven", "float": "float16_t"},
            "saturated": "clamp({}, 0.0hf, 1.0hf)".format,
            "lacks": _NO_BITS,
        },
    },
)  # fmt: skip

ESSL300 = replace(
    GLSL, name="essl300", preamble="precision highp float;\nprecision highp int;", suffixes=(), precisions=_MEDIUMP,
    note=_PRECISION_LINES,
)  # fmt: skip

ESSL100 = replace(
    ESSL300, name="essl100", names={},
    helpers={"round": "float round(float x) {\n    return floor(x + 0.5);\n}"},
    preamble="#ifdef GL_FRAGMENT_PRECISION_HIGH\nprecision highp float;\nprecision highp int;\n"
    "#else\nprecision mediump float;\nprecision mediump int;\n#endif",
    lacks={"float_bits": "bits of floats", "bits_float": "bits of floats", "TABLE": "constant tables"},
    precisions={
        MEDIUMP: {
            "preamble": "precision mediump float;\nprecision mediump int;",
            "lacks": {**_NO_BITS, "TABLE": "constant tables"},
        }
    },
)  # fmt: skip


def _cast(kind: str) -> dict[str, str]:
    """HLSL's functions, whose results some compilers take for floats, and its conversions, by way of floats."""
    same = "abs acos clamp dot exp2 floor log2 max min pow round sqrt float"
    words = {**{name: name for name in same.split()}, "inversesqrt": "rsqrt"}
    return {name: f"({kind}){word}" for name, word in words.items()} | {"cross": f"({kind}3)cross", "int": "(int)float"}


HLSL = Language(
    "hlsl", "float", "int", ("float3", "{}"),
    literal=str, declared=c_declared, header=c_header, chosen=c_chosen, listed=c_listed,
    names={"float_bits": "asint", "bits_float": "asfloat", "inversesqrt": "rsqrt"},
    saturated="saturate({})".format,
    precisions={
        FLOAT16: {
            "float_type": "half", "direction": ("half3", "{}"), "literal": "{}h".format,
            "names": _cast("half"), "saturated": "(half)saturate({})".format, "lacks": _NO_BITS,
            "note": "half has 16 bits under -enable-16bit-types, shader model 6.2",
        },
        MEDIUMP: {
            "float_type": "min16float", "direction": ("min16float3", "{}"),
            "names": _cast("min16float"), "saturated": "(min16float)saturate({})".format, "lacks": _NO_BITS,
        },
    },
)  # fmt: skip

WGSL = Language(
    "wgsl", "f32", "i32", ("vec3f", "{}"),
    literal=str,
    declared=lambda kind, name, value: f"var {name}: {kind} = {value};",
    header=lambda kind, name, arguments: (
        f"fn {name}({', '.join(f'{n}: {k}' for k, n in arguments)}) -> {kind}"
    ),
    chosen=lambda condition, yes, no: f"select({no}, {yes}, {condition})",
    listed=lambda kind, name, values: (
        f"var<private> {name}: array<{kind}, {len(values)}> = array<{kind}, {len(values)}>({', '.join(values)});"
    ),
    names={
        "float_bits": "bitcast<i32>", "bits_float": "bitcast<f32>", "float": "f32", "int": "i32",
        "inversesqrt": "inverseSqrt",
    },
    saturated="saturate({})".format,
    precisions={
        FLOAT16: {
            "float_type": "f16", "direction": ("vec3h", "{}"), "literal": "{}h".format, "preamble": "enable f16;",
            "names": {"float": "f16", "int": "i32", "inversesqrt": "inverseSqrt"}, "lacks": _NO_BITS,
            "note": "the line `enable` stands first in its module",
        },
    },
)  # fmt: skip

METAL = Language(
    "metal", "float", "int", ("float3", "{}"),
    literal="{}f".format, declared=c_declared,
    header=lambda kind, name, arguments: f"inline {c_header(kind, name, arguments)}",
    chosen=c_chosen,
    listed=lambda kind, name, values: c_listed(kind, name, values).replace("static const", "constant"),
    names={"float_bits": "as_type<int>", "bits_float": "as_type<float>", "inversesqrt": "rsqrt", "round": "rint"},
    preamble="#include <metal_stdlib>\nusing namespace metal;",
    saturated="saturate({})".format,
    precisions={
        FLOAT16: {
            "float_type": "half", "direction": ("half3", "{}"), "literal": "{}h".format,
            "names": {"float": "half", "inversesqrt": "rsqrt", "round": "rint"}, "lacks": _NO_BITS,
        },
    },
)  # fmt: skip

_C_NAMES = {
    "abs": "fabsf", "acos": "acosf", "exp": "expf", "exp2": "exp2f", "floor": "floorf", "log2": "log2f",
    "max": "fmaxf", "min": "fminf", "pow": "powf", "round": "rintf", "sqrt": "sqrtf",
}  # fmt: skip
#: subnormal numbers take x86 a hundred cycles each: there the guard is worth a comparison, elsewhere a maximum is less
_C_HELPERS = {
    "clamp": "static inline {0} clamp({0} x, {0} low, {0} high) {{\n    {0} above = x > low ? x : low;\n"
    "    return above < high ? above : high;\n}}",
    "guarded": "static inline {0} guarded({0} x, {0} least) {{\n#if defined(__x86_64__) || defined(_M_X64)\n"
    "    return x > least ? x : 0;\n#else\n    (void)least;\n    return x > 0 ? x : 0;\n#endif\n}}",
    "guarded_square": "static inline {0} guarded_square({0} x, {0} least) {{\n"
    "#if defined(__x86_64__) || defined(_M_X64)\n    return x > least ? x * x : 0;\n#else\n    (void)least;\n"
    "    {0} above = x > 0 ? x : 0;\n    return above * above;\n#endif\n}}",
}
#: microcontrollers without vectors, where a branch is less than a choice and spares the rest
_SCALAR = "#if defined(__ARM_ARCH_PROFILE) && __ARM_ARCH_PROFILE == 'M' && !defined(__ARM_FEATURE_MVE)"
C = Language(
    "c", "float", "int", ("const float", "{}[3]"), suffixes=("h",),
    literal="{}f".format, declared=c_declared,
    header=lambda kind, name, arguments: f"static inline {c_header(kind, name, arguments)}",
    chosen=c_chosen, listed=c_listed,
    names={**_C_NAMES, "float": "(float)", "int": "(int)"},
    helpers={
        "float_bits": "static inline int float_bits(float x) {\n    int bits;\n    memcpy(&bits, &x, sizeof bits);\n"
        "    return bits;\n}",
        "bits_float": "static inline float bits_float(int bits) {\n    float x;\n    memcpy(&x, &bits, sizeof x);\n"
        "    return x;\n}",
        **{name: text.format("float") for name, text in _C_HELPERS.items()},
    },
    preamble="#include <math.h>\n#include <string.h>",
    components=("[0]", "[1]", "[2]"),
    gpu=False,
    leaving=lambda cosine, dark: [_SCALAR, f"if (!({cosine} > {dark})) return {dark};", "#endif"],
    precisions={
        FLOAT16: {  # its functions are those of float, which are rounded
            "float_type": "_Float16", "direction": ("const _Float16", "{}[3]"), "literal": "{}f16".format,
            "names": {
                **{name: f"(_Float16){word}" for name, word in _C_NAMES.items()}, "float": "(_Float16)", "int": "(int)",
            },
            "helpers": {name: text.format("_Float16") for name, text in _C_HELPERS.items()},
            "preamble": "#include <math.h>", "lacks": _NO_BITS,
        },
    },
)  # fmt: skip

_ON_DEVICE = "static __device__ inline "
CUDA = Language(
    "cuda", "float", "int", ("float3", "{}"), suffixes=("cu", "cuh"),
    literal="{}f".format, declared=c_declared,
    header=lambda kind, name, arguments: f"{_ON_DEVICE}{c_header(kind, name, arguments)}",
    chosen=c_chosen,
    listed=lambda kind, name, values: c_listed(kind, name, values).replace("static", "static __device__"),
    names={
        **C.names, "float_bits": "__float_as_int", "bits_float": "__int_as_float", "inversesqrt": "rsqrtf",
        "clamp": "limited", "log2": "__log2f", "pow": "__powf",
    },
    helpers={
        "clamp": f"{_ON_DEVICE}float limited(float x, float low, float high) {{\n"
        "    return fminf(fmaxf(x, low), high);\n}",
        "saturated_sum": f"{_ON_DEVICE}float saturated_sum(float x, float y, float z) {{\n    float sum;\n"
        '    asm("fma.rn.ftz.sat.f32 %0, %1, %2, %3;" : "=f"(sum) : "f"(x), "f"(y), "f"(z));\n    return sum;\n}',
    },
    note="compile with --use_fast_math, or divisions and exponentials take several times as long",
    components=(".x", ".y", ".z"),
    saturated="__saturatef({})".format, saturated_sum="saturated_sum",
    precisions={
        FLOAT16: {
            "float_type": "__half", "direction": ("const __half", "{}[3]"), "literal": "__half({}f)".format,
            "names": {
                "abs": "__habs", "acos": "arc_cosine", "clamp": "limited", "exp2": "hexp2", "float": "__half",
                "floor": "hfloor", "int": "int", "inversesqrt": "hrsqrt", "log2": "hlog2", "max": "__hmax",
                "min": "__hmin", "pow": "powered", "round": "hrint", "saturated_sum": "__hfma_sat", "sqrt": "hsqrt",
            },
            "helpers": {
                "acos": f"{_ON_DEVICE}__half arc_cosine(__half x) {{\n    return __half(acosf(float(x)));\n}}",
                "clamp": f"{_ON_DEVICE}__half limited(__half x, __half low, __half high) {{\n"
                "    return __hmin(__hmax(x, low), high);\n}",
                "pow": f"{_ON_DEVICE}__half powered(__half x, __half y) {{\n    return hexp2(y * hlog2(x));\n}}",
            },
            "preamble": "#include <cuda_fp16.h>", "components": C.components,
            "lacks": {**_NO_BITS, "TABLE": "constant tables"},
            "saturated": "__hmul_sat({}, __half(1.0f))".format,
        },
    },
)  # fmt: skip


def _python(header: str, lines: list[str]) -> str:
    said = '"""The highlight of directions, arrays (..., 3) that broadcast against each other."""'
    body = [f"    {said}", '    with np.errstate(all="ignore"):', *(f"        {line}" for line in lines)]
    return "\n".join([header, *body])


def _where(kind: str, condition: str, yes: str, no: str) -> str:
    """One of two values; numbers alone would be float64."""
    typed = f"{kind}({yes})" if "." in yes and yes.replace(".", "").isdigit() and no.replace(".", "").isdigit() else yes
    return f"np.where({condition}, {typed}, {no})"


def _numpy_names(kind: str) -> Mapping[str, Any]:
    """What depends on the type of the numbers."""
    return {
        "float_type": kind,
        "unpacked": lambda names: [
            f"{name}x, {name}y, {name}z = np.moveaxis(np.asarray({name}, {kind}), -1, 0)" for name in names
        ],
        "names": {
            "abs": "np.abs", "acos": "np.arccos", "exp2": "np.exp2", "float": kind, "floor": "np.floor",
            "int": "np.int32", "log2": "np.log2", "max": "np.fmax", "min": "np.fmin", "pow": "np.power",
            "round": "np.rint", "sqrt": "np.sqrt",
        },
        "helpers": {
            "float_bits": "def float_bits(x):\n    return np.asarray(x).view(np.int32)",
            "bits_float": "def bits_float(bits):\n    return np.asarray(bits).view(np.float32)",
            "clamp": "def clamp(x, low, high):\n    return np.where(x > low, np.fmin(x, high), low)",
            "inversesqrt": "def inversesqrt(x):\n    return 1.0 / np.sqrt(x)",
            "multiply_add": "def multiply_add(factor, x, summand):\n"
            f"    return {kind}(np.float64({kind}(factor)) * x + np.float64({kind}(summand)))",
        },
        "chosen": lambda condition, yes, no: _where(kind, condition, yes, no),
        "listed": lambda _, name, values: f"{name} = np.array([{', '.join(values)}], {kind})",
    }  # fmt: skip


NUMPY = Language(
    "numpy", integer_type="int", direction=("", "{}"), suffixes=("py",),
    literal=str, declared=lambda _, name, value: f"{name} = {value}",
    header=lambda _, name, arguments: f"def {name}({', '.join(n for _, n in arguments)}):",
    preamble="import numpy as np",
    components=("x", "y", "z"),
    gpu=False,
    saturated="np.fmin(np.fmax({}, 0.0), 1.0)".format,
    returned="return {}".format, function=_python, comment="#", tight=True,
    logic={"and": "&", "or": "|", "not": "~", "true": "True", "false": "False"},
    precisions={FLOAT16: {**_numpy_names("np.float16"), "lacks": _NO_BITS}},
    **_numpy_names("np.float32"),
)  # fmt: skip

LANGUAGES = {one.name: one for one in (GLSL, HLSL, WGSL, METAL, C, ESSL100, ESSL300, CUDA, NUMPY)}


def language_named(name: str) -> Language:
    """The language of this name; UnknownNameError lists those there are."""
    if name not in LANGUAGES:
        raise UnknownNameError("language", name, LANGUAGES, "language")
    return LANGUAGES[name]


def language_of_file(suffix: str) -> str | None:
    """The name of the language that files with this end are written in; None for "", the end itself for another."""
    return next((one.name for one in LANGUAGES.values() if suffix in one.suffixes), suffix) or None
