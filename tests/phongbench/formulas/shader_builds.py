"""Formulas' code in other languages, compiled by what is here into functions of arrays."""

import ctypes
import itertools
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import Options, shader

ALPHA = 32.0
#: every approximation in every form and space that it has
CASES = [
    (s.name, form, space) for s in REGISTRY.values() for form, space in itertools.product(s.lambda_forms, s.spaces)
]
#: what a loop over pairs looks like
LOOP = """
    for (int i = 0; i < count; i++) out[i] = highlight({a}, {b});
}}
"""
SHIM = """
#include <cmath>
#include <cstring>
using std::abs; using std::floor; using std::exp; using std::pow; using std::acos; using std::sqrt;
using std::min; using std::max;
struct float3 { float x, y, z; };
static float3 operator-(float3 a, float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static float3 cross(float3 a, float3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static float min(float a, float b) { return fminf(a, b); }
static float max(float a, float b) { return fmaxf(a, b); }
static float clamp(float x, float low, float high) { return min(max(x, low), high); }
static float saturate(float x) { return clamp(x, 0, 1); }
static int asint(float x) { int bits; memcpy(&bits, &x, sizeof bits); return bits; }
static float asfloat(int bits) { float x; memcpy(&x, &bits, sizeof x); return x; }
"""
#: what nvrtc knows without a header, in C++
CUDA = """
#include <cmath>
#include <cstring>
#define __device__
struct float3 { float x, y, z; };
static float rsqrtf(float x) { return 1 / sqrtf(x); }
static float __saturatef(float x) { return fminf(fmaxf(x, 0), 1); }
#define asm(...) sum = __saturatef(x * y + z)
#define __powf powf
#define __log2f log2f
static int __float_as_int(float x) { int bits; memcpy(&bits, &x, sizeof bits); return bits; }
static float __int_as_float(int bits) { float x; memcpy(&x, &bits, sizeof x); return x; }
"""
#: the header that Metal's own compiler brings, as templates: mixed types find none, as there
METAL = """
#include <cmath>
#include <cstring>
#define constant static const
using half = _Float16;
constexpr half operator""h(long double x) { return half(x); }
template <class T> struct vec3 { T x, y, z; };
using float3 = vec3<float>;
using half3 = vec3<half>;
namespace metal {
template <class To, class T> To as_type(T x) { To y; memcpy(&y, &x, sizeof y); return y; }
template <class T> T min(T a, T b) { return T(fminf(float(a), float(b))); }
template <class T> T max(T a, T b) { return T(fmaxf(float(a), float(b))); }
template <class T> T clamp(T x, T low, T high) { return min(max(x, low), high); }
template <class T> T saturate(T x) { return clamp(x, T(0), T(1)); }
template <class T> T abs(T x) { return T(fabsf(float(x))); }
#define OF(name) template <class T> T name(T x) { return T(name##f(float(x))); }
OF(acos) OF(exp2) OF(floor) OF(log2) OF(rint) OF(sqrt)
template <class T> T pow(T x, T y) { return T(powf(float(x), float(y))); }
template <class T> T rsqrt(T x) { return T(1 / sqrtf(float(x))); }
template <class T> vec3<T> operator+(vec3<T> a, vec3<T> b) { return {T(a.x + b.x), T(a.y + b.y), T(a.z + b.z)}; }
template <class T> vec3<T> operator-(vec3<T> a, vec3<T> b) { return {T(a.x - b.x), T(a.y - b.y), T(a.z - b.z)}; }
template <class T> vec3<T> operator*(T s, vec3<T> a) { return {T(s * a.x), T(s * a.y), T(s * a.z)}; }
template <class T> vec3<T> operator*(vec3<T> a, T s) { return s * a; }
template <class T> T dot(vec3<T> a, vec3<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T> vec3<T> cross(vec3<T> a, vec3<T> b) {
    return {T(a.y * b.z - a.z * b.y), T(a.z * b.x - a.x * b.z), T(a.x * b.y - a.y * b.x)};
}
}
struct Given {
    const float *at;
    template <class T> operator vec3<T>() const { return {T(at[0]), T(at[1]), T(at[2])}; }
};
template <class T, class V> T called(T (*of)(V, V), const float *a, const float *b) { return of(Given{a}, Given{b}); }
template <class T, class V> T called(T (*of)(V, V, V), const float *a, const float *b) {
    return of(Given{a}, Given{b}, Given{b});
}
"""
#: language -> compiler, its options, and what stands before and after the source to make a library of it
BUILDS = {
    "c": (
        "cc",
        ["-x", "c", "-std=c99", "-Wall", "-Wextra", "-Wconversion"],
        "",
        "void run",
        LOOP.format(a="a + 3 * i", b="b + 3 * i"),
    ),
    "hlsl": (
        "c++",
        ["-x", "c++", "-Wno-unused-function", "-fsingle-precision-constant"],
        SHIM,
        'extern "C" void run',
        LOOP.format(a="float3{a[3 * i], a[3 * i + 1], a[3 * i + 2]}", b="float3{b[3 * i], b[3 * i + 1], b[3 * i + 2]}"),
    ),
}
BUILDS["cuda"] = (*BUILDS["hlsl"][:2], CUDA, *BUILDS["hlsl"][3:])
BUILDS["metal"] = (
    "c++",
    ["-x", "c++", "-Wall", "-Wextra", "-Wdouble-promotion", "-Wno-unused-function"],
    "",
    'extern "C" void run',
    LOOP.replace("highlight({a}, {b})", "called(highlight, a + 3 * i, b + 3 * i)").format(),
)
#: language -> the header that its text includes: its name and text
HEADERS = {"metal": ("metal_stdlib", METAL)}
_USUAL = ("-Werror", "-O1", "-ffp-contract=off", "-shared", "-fPIC")


def formula_of(name: str, form: str, space: str) -> Formula:
    """One of CASES with a gamma and a slope."""
    return Formula.of(name, form, 8, REGISTRY[name].slopes[-1], space)


def text_of(formula: Formula | str, language: str, alpha: float = ALPHA, **options: Any) -> str:
    """Its code."""
    one = Formula.parse(formula) if isinstance(formula, str) else formula
    return _text(one, alpha, Options(language, **options))


@cache
def _text(formula: Formula, alpha: float, options: Options) -> str:
    """Kept: its errors are measured whenever it is written, and several tests look at the same."""
    return shader(formula, alpha, options).text


def built(language: str, text: str, folder: Path, *more: str) -> Any:
    """(a, b) -> highlights, by the text compiled with warnings as errors; `more` options follow the usual ones."""
    return all_built(language, [text], folder, *more)[0]


def all_built(language: str, texts: Sequence[str], folder: Path, *more: str) -> list[Any]:
    """As `built`, of several texts by one compiler, to which starting, reading its headers and linking are most of it.

    In C each is a source of its own. In C++ they are namespaces of one, but those that bring their headers themselves.
    """
    if language == "numpy":
        return [_executed(text) for text in texts]
    compiler, options, shim, begin, loop = BUILDS[language]
    found = shutil.which(compiler)
    if found is None:
        pytest.skip(f"no {compiler} here")
    for name, header in [HEADERS[language]] if language in HEADERS else ():
        (folder / name).write_text(header)
        more = (*more, "-isystem", str(folder))
    arguments = "(int count, const float *a, const float *b, float *out) {"
    parts = [f"{text}\n{begin}{i}{arguments}{loop}" for i, text in enumerate(texts)]
    wholes = ["\n".join([shim, *(f"namespace n{i} {{\n{part}}}\n" for i, part in enumerate(parts))])] if shim else parts
    sources, library = [folder / f"source{i}" for i in range(len(wholes))], folder / "library.so"
    for source, whole in zip(sources, wholes, strict=True):
        source.write_text(whole)
    subprocess.run([found, *options, *_USUAL, *more, "-o", library, *sources, "-lm"], check=True)
    opened = ctypes.CDLL(str(library))
    return [_over_arrays(opened[f"run{i}"]) for i in range(len(texts))]


def _executed(text: str) -> Any:
    scope: dict[str, Any] = {}
    exec(text, scope)
    return scope["highlight"]


def _over_arrays(run: Any) -> Any:
    """The compiled loop as a function of arrays."""
    rows = np.ctypeslib.ndpointer(np.float32, flags="C")
    run.argtypes, run.restype = [ctypes.c_int, rows, rows, rows], None

    def values(a: Any, b: Any) -> Any:
        out = np.empty(len(a), np.float32)
        run(len(a), a, b, out)
        return out

    return values


def pairs(alpha: float, count: int = 2000) -> tuple[Any, Any]:
    """Directions within a few widths of the highlight and anywhere, lengths up to a tenth wrong, and hostile ones."""
    rng = np.random.default_rng(1)
    a = rng.normal(size=(count, 3))
    spread = np.where(np.arange(count) % 4, 2 / np.sqrt(alpha), 10.0)[:, None]
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = a + spread * rng.normal(size=(count, 3))
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    a *= rng.uniform(0.9, 1.0, (count, 1))
    hostile = np.array([[0, 0, 0], [0, 0, 1], [np.nan, 0, 1], [1e-30, 0, 0], [0, 0, -1]])
    both = np.array(list(itertools.product(hostile, hostile)))
    a, b = np.concatenate([a, both[:, 0]]), np.concatenate([b, both[:, 1]])
    return np.ascontiguousarray(a, np.float32), np.ascontiguousarray(b, np.float32)


def writable(formula: Formula, language: str, precision: str = "float32") -> bool:
    """Whether the language has the words for the formula."""
    try:
        text_of(formula, language, precision=precision)
    except InputError:
        return False
    return True
