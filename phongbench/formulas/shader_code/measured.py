"""How far written code is from exact Phong: the very statements, run by NumPy in the precision they are written for.

Every operation is rounded to that precision. Compilers may fuse the multiply-adds that folded constants make, so they
are run both ways, and the larger error counts.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.formulas.formula import Formula
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.shader_code.function import written
from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32, HELD, Language
from phongbench.formulas.shader_code.languages import NUMPY
from phongbench.formulas.shader_code.raw_vectors import arguments
from phongbench.formulas.spec import Approximation, Setting

#: angles at which the largest error is looked for; their squares are evenly spaced, since highlights are narrow
ANGLES = 16_384
#: the plane that directions are laid out in: its first axis and its second, askew to the axes, so that products round
_ACROSS = np.array([2.0, 3.0, 6.0]) / 7.0
_ALONG = np.array([6.0, 2.0, -3.0]) / 7.0
#: turns of the viewer, and of light and viewer together, from the first axis
_VIEW = np.radians(20.0)


def largest_error(
    spec: Approximation,
    formula: Formula,
    setting: Setting,
    language: Language,
    *,
    limited: bool,
    length_error: float = 0.0,
) -> float:
    """The largest error at ANGLES angles between R and V up to 90 degrees, of directions in a plane.

    language      in its precision: that of the directions, constants and operations
    limited       as for `written`
    length_error  how much longer or shorter than 1 the directions may be; each is tried at both ends
    """
    texts = tuple(_text(spec, formula, setting, language, limited=limited, fused=fused) for fused in (False, True))
    return _error_of(texts, formula, setting.alpha, language.precision, length_error)


@lru_cache(maxsize=1 << 10)
def _error_of(texts: tuple[str, ...], formula: Formula, alpha: float, precision: str, length_error: float) -> float:
    """See `largest_error`; languages whose statements are the same, as those of GPUs mostly are, share it.

    texts  both ways in which the code may round, for NumPy
    """
    degrees = 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2
    given, functions = directions(formula, degrees), [_function(text) for text in texts]
    lengths = product(*[(1.0 - length_error, 1.0 + length_error) if length_error else (1.0,)] * len(given))
    largest = 0.0
    for each in lengths:
        held = [_held(length * one, precision) for length, one in zip(each, given, strict=True)]
        truth = np.maximum(cosines(formula, held), 0.0) ** alpha
        for highlight in functions:
            value = highlight(*held)
            error = float(np.abs(value.astype(np.float64) - truth).max())
            largest = math.inf if math.isnan(error) else max(largest, error)
    return largest


def compiled(
    spec: Approximation, formula: Formula, setting: Setting, language: Language, *, limited: bool, fused: bool = False
) -> Callable[..., Array]:
    """What the code for a language computes, as a function of arrays (..., 3) of the language's precision."""
    return _function(_text(spec, formula, setting, language, limited=limited, fused=fused))


def _text(
    spec: Approximation, formula: Formula, setting: Setting, language: Language, *, limited: bool, fused: bool
) -> str:
    """The statements that the language would have, as NumPy's."""
    return written(spec, formula, setting, _in_numpy(language, fused=fused), limited=limited)


def _function(text: str) -> Callable[..., Array]:
    scope: dict[str, Any] = {}
    exec(text, scope)
    made: Callable[..., Array] = scope["highlight"]
    return made


def fuses(spec: Approximation, formula: Formula, setting: Setting, language: Language) -> bool:
    """Whether compilers may fuse a product with the constant that it is added to, so that code rounds in two ways."""
    return "multiply_add(" in written(spec, formula, setting, _in_numpy(language, fused=True))


def _in_numpy(language: Language, *, fused: bool) -> Language:
    """NumPy, with the statements that the language would have."""
    held = FLOAT32 if language.precision == FLOAT32 else FLOAT16
    return replace(NUMPY.in_precision(held), gpu=language.gpu, fused=fused)


def directions(formula: Formula, degrees: Array) -> list[Array]:
    """What `highlight` takes, (n, 3) float64 each, at these angles between R and V, all in one plane."""
    turn = np.radians(np.asarray(degrees, dtype=np.float64))
    if formula.recipe != PAIR:  # L and V on both sides of an axis, N turned from it
        turns: Mapping[str, Any] = {"n": turn / 2, "l": -_VIEW, "v": _VIEW}
    else:
        turns = {"r": turn, "v": 0.0, "n": turn / 2, "h": 0.0}
    found = [np.broadcast_to(turns[name], turn.shape) for name in arguments(formula)]
    return [np.outer(np.cos(one), _ACROSS) + np.outer(np.sin(one), _ALONG) for one in found]


def cosines(formula: Formula, held: list[Array]) -> Array:
    """Cosines of the angles between R and V of directions as they are held, whatever their lengths: (n,) float64."""
    unit = [one / np.linalg.norm(one, axis=-1, keepdims=True) for one in (v.astype(np.float64) for v in held)]
    if formula.recipe == PAIR:
        a, b = unit
        doubled = 2 if formula.space == "half" else 1
    else:
        n, light, b = unit
        a, doubled = 2 * np.sum(n * light, axis=-1, keepdims=True) * n - light, 1
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
    return np.asarray(np.cos(doubled * angle))


def _held(vectors: Array, precision: str) -> Array:
    return np.asarray(vectors, HELD[precision])
