"""The full reflection model over many points and lights: what scenes, the command line and the service shade with.

    I = ka ia + sum over lights of att(d) [ka ia + kd (L.N) id + ks F(V.H) (R.V)^alpha is]

for each colour, R = 2 (N.L) N - L, att(d) = 1 / (c + l d + q d^2). A term counts only where its cosine is positive, the
specular term only where L.N is, too. Model "blinn-phong" has (N.H)^alpha instead, H = (L + V) / |L + V|. Any registered
formula may stand for the specular term. F, the reflectance against incidence, is 1 unless the material says otherwise;
a light's own ia is 0 unless it says otherwise, and needs no cosine.

What need not be computed is left out in blocks and counted; `Skips` says what may be. See tiles.py for how it runs.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from itertools import count as counter
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.compiler.precisions import Array
from phongbench.errors import CancelledError, InputError
from phongbench.formulas.formula import Formula
from phongbench.shading import tiles as at
from phongbench.shading.lighting import Light, Material, Skips, Viewer
from phongbench.shading.prepared import PreparedShading, ShadingOptions

__all__ = ["Formula", "Ledger", "Light", "Material", "Shaded", "Skips", "Viewer", "shade"]

#: pairs between two looks at whether the work is still wanted: a millisecond or so
_PAIRS_AT_ONCE = 1 << 19


@dataclass(frozen=True)
class Ledger:
    """How many of the (point, light) pairs were left out, and why; a pair is counted for the first reason that holds.

    pairs                all
    zero_colours         the light adds nothing: its colours times the material's are 0
    out_of_reach         no point of the tile or block lies within the light's reach
    in_shadow            no point of the block sees the light
    lights_behind        no point of the tile or block faces the light
    beyond_support       the formula, and the reflectance: the block lies beyond the end of its support
    dark_tail            the formula, and the reflectance: exact Phong is below the threshold all over the block
    vectors_not_built    R or H, in a block that faces the light (in others none is built): no specular term asks for it
    vectors_not_normalised  V of a point, or H: the formula removes its length by itself, as phong/once does, so no root
                         is taken for it before
    constant_directions  L, or V: it is the same everywhere, and made unit once; counts each of the two
    The same for the same input, whatever the number of threads.
    """

    pairs: int = 0
    zero_colours: int = 0
    out_of_reach: int = 0
    in_shadow: int = 0
    lights_behind: int = 0
    beyond_support: int = 0
    dark_tail: int = 0
    vectors_not_built: int = 0
    vectors_not_normalised: int = 0
    constant_directions: int = 0

    def as_dict(self) -> dict[str, int]:
        """The `skipped` object of the service's answer."""
        return asdict(self)

    def __add__(self, other: "Ledger") -> "Ledger":
        return Ledger(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


@dataclass(frozen=True)
class Shaded:
    """Colours, laid out and typed as the points were, and what was left out on the way."""

    colours: Array
    ledger: Ledger


def shade(
    points: Array,
    normals: Array,
    *,
    material: Material,
    lights: Sequence[Light],
    viewer: Viewer,
    visible: Array | None = None,
    threads: int = 1,
    cancelled: Callable[[], bool] | None = None,
    out: Array | None = None,
    columns: bool = False,
    **options: Unpack[ShadingOptions],
) -> Shaded:
    """Shade points: the model of this module's docstring.

    points, normals  (n, 3) float32 or float64, both the same. C-contiguous aligned arrays are used as they are,
                     read-only ones too, others are copied
    visible          (lights, n) bool | None   which points see which light; None: all
    threads          int >= 1         the colours are the same for every number
    cancelled        asked about every millisecond; True ends the work
    out              (n, 3) | None    where to write
    columns          whether points, normals, `out` and colours are (3, n) instead: the same bits, a little faster
    options          see ShadingOptions
    returns          Shaded           colours (n, 3); not limited to 1

    Raises InputError naming the field, or the first point (`points[7]`) that is not finite, is further away than its
    square can be computed, or whose normal has no length; CancelledError if the work was given up.
    A light or viewer at a point's own place has no direction: that term is dark there. Attenuation is limited to the
    largest number, so a light without constant term is bright nearby, but not infinite.
    """
    points, normals = _checked("points", points, columns), _checked("normals", normals, columns)
    if points.shape != normals.shape or points.dtype != normals.dtype:
        what = f"normals are {normals.shape} {normals.dtype}, points {points.shape} {points.dtype}"
        raise InputError(what, "normals", "give one normal for each point, of the same type")
    if threads < 1:
        raise InputError(f"{threads} threads", "threads", "give 1 or more")
    count = points.shape[1 if columns else 0]
    seen = _seen(visible, len(lights), count)
    precision = FLOAT32 if points.dtype == np.float32 else FLOAT64
    shadowed = visible is not None
    prepared = PreparedShading(
        material, lights, viewer, shadowed=shadowed, columns=columns, precision=precision, **options
    )
    colours = _output(out, points)
    counts, bad = _run(prepared, (points, normals, colours), seen, threads, cancelled)
    if bad >= 0:
        point, normal = (v.T[bad] if columns else v[bad] for v in (points, normals))
        raise _blame(bad, point, normal, float(at.bounds(precision)[at.LARGEST]))
    return Shaded(colours, Ledger(**prepared.skipped(count, counts)))


def _checked(name: str, given: Any, columns: bool) -> Array:
    """C-contiguous vectors of one of our types."""
    array = np.asarray(given)
    if array.dtype not in (np.float32, np.float64):
        raise InputError(f"{name} are {array.dtype}", name, "give float32 or float64, in the machine's byte order")
    if array.ndim != 2 or array.shape[0 if columns else 1] != 3:
        raise InputError(f"{name} of shape {array.shape}", name, f"give {'(3, n)' if columns else '(n, 3)'}")
    # an unaligned view, as of a part of a request's body, would be another type to numba: it would compile anew
    return np.require(array, requirements=("C", "A"))


def _seen(visible: Any, lights: int, count: int) -> Array | None:
    if visible is None:
        return None
    array = np.asarray(visible)
    if array.dtype != np.bool_ or array.shape != (lights, count):
        raise InputError(
            f"{array.dtype} of shape {array.shape}", "visible", f"give bool of shape (lights, points): {lights, count}"
        )
    return np.ascontiguousarray(array)


def _output(out: Array | None, points: Array) -> Array:
    if out is None:
        return np.empty_like(points)
    if out.shape != points.shape or out.dtype != points.dtype or not (out.flags.c_contiguous and out.flags.writeable):
        wanted = f"{points.dtype} of shape {points.shape}, C-contiguous and writable"
        raise InputError(f"{out.dtype} of shape {out.shape}", "out", f"give {wanted}")
    return out


def _run(
    prepared: PreparedShading,
    vectors: tuple[Array, Array, Array],
    visible: Array | None,
    threads: int,
    cancelled: Callable[[], bool] | None,
) -> tuple[NDArray[np.int64], int]:
    """Shade all tiles, in pieces that threads take in turn; what they counted, and the first bad point, or -1."""
    last = -(-vectors[0].size // (3 * at.TILE))
    step = max(1, _PAIRS_AT_ONCE // (at.TILE * max(1, prepared.used_lights)))
    pieces = counter()
    bad: list[int] = []

    def work() -> NDArray[np.int64]:
        counts, scratch = np.zeros(at.COUNTS, np.int64), at.scratch(prepared.precision)
        lost = np.zeros(1, prepared.precision.carrier)
        while (first := next(pieces) * step) < last and not bad:
            if cancelled is not None and cancelled():
                raise CancelledError("shading was cancelled")
            tiles = first, min(first + step, last)
            index = prepared.fill(*vectors, counts, lost, visible=visible, tiles=tiles, scratch=scratch)
            if index >= 0:
                bad.append(index)
        return counts

    helpers = min(threads, -(-last // step))
    if helpers <= 1:
        return work(), min(bad, default=-1)
    with ThreadPoolExecutor(helpers) as pool:
        counted = [f.result() for f in [pool.submit(work) for _ in range(helpers)]]
    return np.sum(counted, axis=0), min(bad, default=-1)


def _blame(index: int, point: Array, normal: Array, limit: float) -> InputError:
    """What is wrong with the first bad point."""
    for name, vector in (("points", point), ("normals", normal)):
        if not np.isfinite(vector).all():
            return InputError("not finite", f"{name}[{index}]", "give three finite numbers")
        if np.abs(vector).max() > limit:
            what = f"beyond {limit:g}, where squares cannot be computed"
            return InputError(what, f"{name}[{index}]", "come nearer, or use float64")
    return InputError("a normal without length", f"normals[{index}]", "give a direction, or ask not to normalise")
