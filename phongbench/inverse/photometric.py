"""Photometric stereo: normals from several pictures under known lights, by the full reflection model.

For each pixel and light j, with one number for its colour:

    I_j = ambient + e_j (diffuse a (L_j.N) + specular s f(R_j, V))        f = (R_j.V)^alpha, or a formula for it

where L_j.N > 0. N is solved for, and on request the factors a and s, which are 1 else. Light and viewer are far away:
V = (0, 0, 1). x to the right, y up, z to the viewer; rows of pictures go down.

Start   the Lambertian solution of the three darkest usable samples: the highlight is in the brighter ones; where that
        ends in a poor fit, each light's highlight
Source  Woodham 1980 for the start; `solver` for the steps
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inverse import solver
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel, solver_rows
from phongbench.support.values import number

#: pixels that a thread takes at a time
TILE = 1 << 13
#: steps of a pixel at most, and the relative gain or the turn in radians below which it is done
_MOST_STEPS, _ENOUGH = 60.0, 1e-9
#: lights whose directions span less than this share of the largest extent lie in a plane
_FLAT = 1e-3
#: a residual of more than this share of the diffuse term is no noise
_POOR = 0.02
#: samples darker than this share of the diffuse term may be in shadow
_DARK = 0.01


@dataclass(frozen=True, eq=False)
class Normals:
    """What pictures say of a surface; NaN outside the mask and where too few samples are usable.

    normals   (h, w, 3)  unit: x right, y up, z to the viewer
    diffuse   (h, w)     factor of the diffuse term, 1 where it was not solved for
    specular  (h, w)     factor of the specular term, likewise
    residual  (h, w)     root of the mean squared difference between pictures and model
    steps     (h, w)     evaluations of the model
    """

    normals: Array
    diffuse: Array
    specular: Array
    residual: Array
    steps: Array

    def summary(self) -> dict[str, Any]:
        """How many pixels have a normal, and how well the model explains them; None without any."""
        known = np.isfinite(self.normals[..., 0])
        if not known.any():
            return {"pixels": known.size, "known": 0, "residual_rms": None, "steps_mean": None}
        residual, steps = self.residual[known], self.steps[known]
        numbers = {"residual_rms": float(np.sqrt(np.mean(residual**2))), "steps_mean": float(np.mean(steps))}
        return {"pixels": known.size, "known": int(known.sum()), **numbers}


def invert_pictures(
    pictures: Array,
    lights: Sequence[PhotometricLight],
    model: SurfaceModel,
    *,
    mask: Array | None = None,
    albedo: bool = False,
    gloss: bool = False,
    saturation: float = np.inf,
    shadow: float | None = None,
    start: Array | None = None,
    threads: int = 1,
) -> Normals:
    """Normals from pictures under known lights; the model of this module's docstring.

    pictures    (k, h, w)              linear intensities, k >= 3 unless `start` is given: of fewer, the normals are
                                       those nearest to the start that explain them
    lights      k                      of the pictures, in their order
    mask        (h, w) bool | None     pixels that are wanted
    albedo      whether to solve for the factor of the diffuse term
    gloss       whether to solve for the factor of the specular term
    saturation  intensity from which samples are not used
    shadow      intensity above ambient up to which samples are not used; None: 1 % of the diffuse term's
    start       (h, w, 3) | None       normals to start from, instead of the Lambertian solution
    threads     int >= 1               the answer is the same for every number
    Raises InputError naming the argument, the light or the pixel.
    """
    pictures = _pictures(pictures, len(lights), 1 if start is not None else 3)
    _spread(lights, start is not None)
    shape, count = pictures.shape[1:], len(lights)
    inside = _inside(mask, shape)
    observed = np.ascontiguousarray(pictures.reshape(count, -1)[:, inside.ravel()].T)
    strengths = np.array([light.intensity for light in lights])
    dark = _DARK * model.diffuse * strengths if shadow is None else number(shadow, "shadow")
    used = ((observed - model.ambient > dark) & (observed < saturation)).astype(np.uint8)
    needed = min(count, max(3, 2 + albedo + gloss))
    found = np.zeros((len(observed), solver.ANSWERS))
    found[:, solver.OF_DIFFUSE : solver.OF_SPECULAR + 1] = 1.0
    if start is None:
        _lambertian(observed, used, lights, model, found, albedo)
    else:
        found[:, :3] = np.asarray(start, np.float64).reshape(-1, 3)[inside.ravel()]
    found[used.sum(axis=1) < needed, :3] = np.nan
    _solve(observed, used, lights, model, found, (albedo, gloss), threads)
    if start is None and model.specular > 0:
        _again(observed, used, lights, model, found, (albedo, gloss), threads)
    return _laid_out(found, inside)


def _solve(
    observed: Array,
    used: Array,
    lights: Sequence[PhotometricLight],
    model: SurfaceModel,
    found: Array,
    fits: tuple[bool, bool],
    threads: int,
) -> None:
    """Run the solver over tiles of pixels."""
    kernel, numbers = model.kernel(), np.zeros(solver.NUMBERS)
    numbers[: solver.SPECULAR + 1] = model.ambient, model.diffuse, model.specular
    numbers[solver.IS_HALF], numbers[solver.FORM] = (
        model.formula.space == "half",
        solver.FORMS[model.formula.lambda_form],
    )
    numbers[solver.FITS_DIFFUSE : solver.FITS_SPECULAR + 1] = fits
    numbers[solver.MOST], numbers[solver.ENOUGH] = _MOST_STEPS, _ENOUGH
    arguments = solver_rows(lights), numbers, (kernel.coefficients, kernel.table)

    def tile(first: int) -> None:
        part = slice(first, first + TILE)
        solver.solve_pixels(kernel.address, observed[part], used[part], *arguments, found[part])

    tile(len(observed))  # compiled here, once
    starts = range(0, len(observed), TILE)
    if threads == 1 or len(starts) < 2 or jit.DISABLED:
        for first in starts:
            tile(first)
        return
    with ThreadPoolExecutor(min(threads, len(starts))) as pool:
        list(pool.map(tile, starts))


def _again(
    observed: Array,
    used: Array,
    lights: Sequence[PhotometricLight],
    model: SurfaceModel,
    found: Array,
    fits: tuple[bool, bool],
    threads: int,
) -> None:
    """Pixels that the model does not explain start once more from each light's highlight; the best answer stays.

    From a start beyond a highlight's flank, steps may end in a local minimum.
    """
    for half in solver_rows(lights)[:, solver.HALF : solver.HALF + 3]:
        with np.errstate(invalid="ignore"):
            poor = np.flatnonzero(found[:, solver.RESIDUAL] > _POOR * model.diffuse)
        if not len(poor):
            return
        tried = found[poor]
        tried[:, :3], tried[:, solver.OF_DIFFUSE : solver.OF_SPECULAR + 1] = half, 1.0
        _solve(observed[poor], used[poor], lights, model, tried, fits, threads)
        better = tried[:, solver.RESIDUAL] < found[poor, solver.RESIDUAL]
        tried[:, solver.STEPS] += found[poor, solver.STEPS]
        found[poor[better]] = tried[better]


def _lambertian(
    observed: Array, used: Array, lights: Sequence[PhotometricLight], model: SurfaceModel, found: Array, albedo: bool
) -> None:
    """Start from the matt surface that explains the darkest usable samples; NaN where there is none.

    Three samples, unless their lights lie nearly in a plane: then one more, and so on.
    """
    directions = np.array([light.direction for light in lights])
    strengths = np.array([light.intensity for light in lights])
    lit = (observed - model.ambient) / (model.diffuse * strengths)
    order = np.argsort(np.where(used > 0, lit, np.inf), axis=1)
    usable = used.sum(axis=1)
    answer = np.full((len(observed), 3), np.nan)
    for size in range(3, len(lights) + 1):
        chosen = np.sort(order[:, :size], axis=1)
        open_ = np.isnan(answer[:, 0]) & (usable >= size)
        for subset in combinations(range(len(lights)), size) if open_.any() else ():
            rows = directions[list(subset)]
            spans = np.linalg.svd(rows, compute_uv=False)
            if spans[2] < _FLAT * spans[0]:
                continue
            mine = open_ & (chosen == subset).all(axis=1)
            answer[mine] = lit[mine][:, list(subset)] @ np.linalg.pinv(rows).T
    length = np.linalg.norm(answer, axis=1)
    with np.errstate(invalid="ignore"):
        found[:, :3] = np.where(length[:, None] > 0, answer / length[:, None], np.nan)
    if albedo:
        found[:, solver.OF_DIFFUSE] = length


def _laid_out(found: Array, inside: Array) -> Normals:
    """The answers of the pixels as pictures."""
    laid = np.full((*inside.shape, solver.ANSWERS), np.nan)
    found[np.isnan(found[:, 0])] = np.nan
    laid[inside] = found
    names = {"diffuse": solver.OF_DIFFUSE, "specular": solver.OF_SPECULAR, "residual": solver.RESIDUAL}
    parts = {name: laid[..., column].copy() for name, column in names.items()}
    return Normals(laid[..., :3].copy(), steps=laid[..., solver.STEPS].copy(), **parts)


def _pictures(given: Any, lights: int, least: int) -> Array:
    try:
        pictures = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("no pictures of one size", "pictures", "give an array (k, height, width)") from None
    if pictures.ndim != 3:
        raise InputError(f"pictures of shape {pictures.shape}", "pictures", "give (k, height, width)")
    if len(pictures) < least:
        raise InputError(f"{len(pictures)} pictures", "pictures", f"a normal needs {least} or more")
    if len(pictures) != lights:
        raise InputError(f"{lights} lights for {len(pictures)} pictures", "lights", "give one light for each picture")
    bad = np.argwhere(~np.isfinite(pictures))
    if len(bad):
        k, row, column = (int(i) for i in bad[0])
        raise InputError(f"column {column} of row {row} is not finite", f"pictures[{k}]", "mask it, or mend the file")
    return pictures


def _spread(lights: Sequence[PhotometricLight], started: bool) -> None:
    """Refuse lights in a plane: a normal's part across it would be unknown."""
    if started:
        return
    directions = np.array([light.direction for light in lights])
    spans = np.linalg.svd(directions, compute_uv=False)
    if spans[-1] < _FLAT * spans[0]:
        cosines = np.abs(directions @ directions.T) - np.eye(len(lights))
        one, other = sorted(int(i) for i in np.unravel_index(np.argmax(cosines), cosines.shape))
        what = f"lights {one} and {other} are parallel" if cosines.max() > 1 - _FLAT**2 else "all lights lie in a plane"
        raise InputError(what, f"lights[{other}]", "move one of them: three directions out of a plane are needed")


def _inside(mask: Any, shape: tuple[int, ...]) -> Array:
    if mask is None:
        return np.ones(shape, bool)
    inside = np.asarray(mask)
    if inside.shape != shape:
        raise InputError(f"a mask of shape {inside.shape} for pictures of {shape}", "mask", "give one of their size")
    return inside.astype(bool)
