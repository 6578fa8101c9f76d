"""The full reflection model over many points and lights: what scenes, the command line and the service shade with.

    I = ka ia + sum over lights of att(d) [kd (L.N) id + ks (R.V)^alpha is]

for each colour, R = 2 (N.L) N - L, att(d) = 1 / (c + l d + q d^2). A term counts only where its cosine is positive, the
specular term only where L.N is, too. Model "blinn-phong" has (N.H)^alpha instead, H = (L + V) / |L + V|. Any registered
formula may stand for the specular term.

What need not be computed is left out in blocks and counted; `Skips` says what may be. See tiles.py for how it runs.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from itertools import count as counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.errors import CancelledError, InputError
from phongbench.formulas.formula import Specular
from phongbench.formulas.kernel import read_only
from phongbench.formulas.registry import REGISTRY
from phongbench.shading import tile_loop
from phongbench.shading import tiles as at
from phongbench.shading.lighting import BLACK, Light, Material, Skips, Viewer
from phongbench.shading.loop_arguments import Job, formula_of, job_of
from phongbench.support.values import colour

__all__ = ["Ledger", "Light", "Material", "Shaded", "Skips", "Specular", "Viewer", "shade", "shade_columns"]
from phongbench.compiler.precisions import Array

#: pairs between two looks at whether the work is still wanted: a millisecond or so
_PAIRS_AT_ONCE = 1 << 19
_PHONG, _ALL = Specular(), Skips()


@dataclass(frozen=True)
class Ledger:
    """How many of the (point, light) pairs were left out, and why; a pair is counted for the first reason that holds.

    pairs                all
    zero_colours         the light adds nothing: its colours times the material's are 0
    out_of_reach         no point of the tile or block lies within the light's reach
    in_shadow            no point of the block sees the light
    lights_behind        no point of the tile or block faces the light
    beyond_support       the formula: the block lies beyond the end of its support
    dark_tail            the formula: exact Phong is below the threshold all over the block
    vectors_not_built    R or H: no specular term asks for it
    constant_directions  L, or V: it is the same everywhere; counts each of the two
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
    ambient_light: Sequence[float] = BLACK,
    model: str = "phong",
    specular: Specular = _PHONG,
    normalise: bool = True,
    visible: Array | None = None,
    skips: Skips = _ALL,
    threads: int = 1,
    cancelled: Callable[[], bool] | None = None,
    out: Array | None = None,
    registry: Any = REGISTRY,
) -> Shaded:
    """Shade points: the model of this module's docstring.

    points, normals  (n, 3) float32 or float64, both the same. C-contiguous aligned arrays are used as they are,
                     read-only ones too, others are copied
    ambient_light    (r, g, b) >= 0   ia
    model            "phong" or "blinn-phong"
    normalise        whether normals are made unit length first; False takes them as they are: short normals point R in
                     the wrong direction, which is what studies of meshes are about
    visible          (lights, n) bool | None   which points see which light; None: all
    skips            what may be left out; where nothing may, every pair is computed
    threads          int >= 1         the colours are the same for every number
    cancelled        asked about every millisecond; True ends the work
    out              (n, 3) | None    where to write
    registry         the approximations that `specular` may name
    returns          Shaded           colours (n, 3); not limited to 1

    Raises InputError naming the field, or the first point (`points[7]`) that is not finite, is further away than its
    square can be computed, or whose normal has no length; CancelledError if the work was given up.
    A light or viewer at a point's own place has no direction: that term is dark there. Attenuation is limited to the
    largest number, so a light without constant term is bright nearby, but not infinite.
    """
    return _shade(
        points,
        normals,
        False,
        material,
        lights,
        viewer,
        ambient_light,
        model,
        specular,
        normalise,
        visible,
        skips,
        threads,
        cancelled,
        out,
        registry,
    )


def shade_columns(points: Array, normals: Array, **wishes: Any) -> Shaded:
    """`shade` for structures of arrays: points, normals, `out` and colours of shape (3, n), a row for each component.

    The same loops, the same bits, and a little faster.
    """
    named: dict[str, Any] = {
        "ambient_light": BLACK,
        "model": "phong",
        "specular": _PHONG,
        "normalise": True,
        "visible": None,
        "skips": _ALL,
        "threads": 1,
        "cancelled": None,
        "out": None,
        "registry": REGISTRY,
    }
    return _shade(points, normals, True, **{**named, **wishes})


def _shade(
    points: Array,
    normals: Array,
    columns: bool,
    material: Material,
    lights: Sequence[Light],
    viewer: Viewer,
    ambient_light: Sequence[float],
    model: str,
    specular: Specular,
    normalise: bool,
    visible: Array | None,
    skips: Skips,
    threads: int,
    cancelled: Callable[[], bool] | None,
    out: Array | None,
    registry: Any,
) -> Shaded:
    points, normals = _checked("points", points, columns), _checked("normals", normals, columns)
    if points.shape != normals.shape or points.dtype != normals.dtype:
        raise InputError(
            f"normals are {normals.shape} {normals.dtype}, points {points.shape} {points.dtype}",
            "normals",
            "give one normal for each point, of the same type",
        )
    if threads < 1:
        raise InputError(f"{threads} threads", "threads", "give 1 or more")
    precision = FLOAT32 if points.dtype == np.float32 else FLOAT64
    count = points.shape[1 if columns else 0]
    seen = _seen(visible, len(lights), count)
    formula = formula_of(material, model, specular, registry, precision, skips)
    job = job_of(formula, material, lights, viewer, skips, precision, shadowed=visible is not None)
    job.options[[at.COLUMNS, at.NORMALISE]] = columns, normalise
    ambient = [k * i for k, i in zip(material.ambient, colour(ambient_light, "ambient_light"), strict=True)]
    colours = _output(out, points)
    inputs = [read_only(v) for v in (points.reshape(-1), normals.reshape(-1), seen)]
    with np.errstate(over="ignore"):  # light beyond the range of float32 is infinite, as the loops make it
        glow = np.array(ambient, precision.carrier)
    counts = _run(job, inputs, glow, colours.reshape(-1), threads, cancelled)
    return Shaded(colours, _ledger(job, counts, count, len(lights)))


def _checked(name: str, given: Any, columns: bool) -> Array:
    """C-contiguous vectors of one of our types."""
    array = np.asarray(given)
    if array.dtype not in (np.float32, np.float64):
        raise InputError(f"{name} are {array.dtype}", name, "give float32 or float64, in the machine's byte order")
    if array.ndim != 2 or array.shape[0 if columns else 1] != 3:
        raise InputError(f"{name} of shape {array.shape}", name, f"give {'(3, n)' if columns else '(n, 3)'}")
    # an unaligned view, as of a part of a request's body, would be another type to numba: it would compile anew
    return np.require(array, requirements=("C", "A"))


def _seen(visible: Any, lights: int, count: int) -> Array:
    if visible is None:
        return np.zeros((0, 0), np.uint8)
    array = np.asarray(visible)
    if array.dtype != np.bool_ or array.shape != (lights, count):
        raise InputError(
            f"{array.dtype} of shape {array.shape}", "visible", f"give bool of shape (lights, points): {lights, count}"
        )
    return np.ascontiguousarray(array).view(np.uint8)


def _output(out: Array | None, points: Array) -> Array:
    if out is None:
        return np.empty_like(points)
    if out.shape != points.shape or out.dtype != points.dtype or not (out.flags.c_contiguous and out.flags.writeable):
        wanted = f"{points.dtype} of shape {points.shape}, C-contiguous and writable"
        raise InputError(f"{out.dtype} of shape {out.shape}", "out", f"give {wanted}")
    return out


def _run(
    job: Job, inputs: list[Array], ambient: Array, out: Array, threads: int, cancelled: Callable[[], bool] | None
) -> NDArray[np.int64]:
    """Run the loop over all tiles, in pieces that threads take in turn; what it counted."""
    last = -(-len(out) // (3 * at.TILE))
    step = max(1, _PAIRS_AT_ONCE // (at.TILE * max(1, len(job.lights))))
    spread = np.ascontiguousarray(job.lights.T).reshape(-1)
    limits = at.bounds(job.formula.precision)
    values, row, table = job.formula.arguments()
    points, normals, visible = inputs
    towards = read_only(np.zeros(0, points.dtype))
    pieces = counter()
    bad: list[int] = []

    def work() -> NDArray[np.int64]:
        counts, tile = np.zeros(at.COUNTS, np.int64), at.scratch(job.formula.precision)
        lost = np.zeros(1, points.dtype)
        while (first := next(pieces) * step) < last and not bad:
            if cancelled is not None and cancelled():
                raise CancelledError("shading was cancelled")
            part = np.array([first, min(first + step, last)])
            found = tile_loop.shade_tiles(
                points,
                normals,
                visible,
                towards,
                job.lights,
                spread,
                job.plan,
                ambient,
                values,
                row,
                table,
                limits,
                job.options,
                part,
                out,
                counts,
                lost,
                tile,
            )
            if found >= 0:
                bad.append(int(found))
        return counts

    helpers = min(threads, -(-last // step))
    if helpers <= 1:
        total = work()
    else:
        with ThreadPoolExecutor(helpers) as pool:
            total = np.sum([f.result() for f in [pool.submit(work) for _ in range(helpers)]], axis=0)
    if bad:
        raise _blame(min(bad), inputs, bool(job.options[at.COLUMNS]), float(limits[at.LARGEST]))
    return total


def _blame(index: int, inputs: list[Array], columns: bool, limit: float) -> InputError:
    """What is wrong with the first bad point."""
    for name, flat in zip(("points", "normals"), inputs, strict=False):
        vector = flat.reshape(3, -1)[:, index] if columns else flat.reshape(-1, 3)[index]
        if not np.isfinite(vector).all():
            return InputError("not finite", f"{name}[{index}]", "give three finite numbers")
        if np.abs(vector).max() > limit:
            return InputError(
                f"beyond {limit:g}, where squares cannot be computed", f"{name}[{index}]", "come nearer, or use float64"
            )
    return InputError("a normal without length", f"normals[{index}]", "give a direction, or ask not to normalise")


def _ledger(job: Job, counts: NDArray[np.int64], points: int, lights: int) -> Ledger:
    return Ledger(
        pairs=points * lights,
        zero_colours=points * job.left_out,
        out_of_reach=int(counts[at.OUT]),
        in_shadow=int(counts[at.SHADE]),
        lights_behind=int(counts[at.BEHIND]),
        vectors_not_built=int(counts[at.UNBUILT]),
        constant_directions=points * job.constant,
        **{job.formula.ends: int(counts[at.UNLIT])},
    )
