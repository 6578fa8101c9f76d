"""Photometric stereo: normals from several pictures under known lights, by the full reflection model.

For each pixel and light j, with one number for its colour:

    I_j = ambient + e_j (diffuse a (L_j.N) + specular s f(R_j, V))        f = (R_j.V)^alpha, or a formula for it

where L_j.N > 0. N is solved for, and on request the factors a and s, which are 1 else. Light and viewer are far away:
V = (0, 0, 1). x to the right, y up, z to the viewer; rows of pictures go down.

Start   the Lambertian solution of the three darkest usable samples: the highlight is in the brighter ones; where that
        ends in a poor fit, each light's highlight
Source  Woodham 1980, Optical Engineering 19(1), for the start; `solver` for the steps
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
from phongbench.inverse.surface_heights import integrate
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel, solver_rows
from phongbench.support.values import number

#: pixels that a thread takes at a time
TILE = 1 << 13
#: steps of a pixel at most, and the relative gain or the turn in radians below which it is done
_MOST_STEPS, _ENOUGH = 60.0, 1e-9
#: lights whose directions span less than this share of the largest extent lie in a plane
_FLAT = 1e-3
#: the largest size of an intensity
_BRIGHTEST = 1e9
#: shares of the diffuse term: a residual above is no noise; a sample below may be in shadow
_POOR, _DARK = 0.02, 0.01


@dataclass(frozen=True, eq=False)
class Normals:
    """What pictures say of a surface; NaN outside the mask and where too few samples are usable.

    normals            (h, w, 3)  unit: x right, y up, z to the viewer
    diffuse, specular  (h, w)     factors of the terms, 1 where they were not solved for
    residual           (h, w)     root of the mean squared difference between pictures and model
    steps              (h, w)     evaluations of the model
    """

    normals: Array
    diffuse: Array
    specular: Array
    residual: Array
    steps: Array

    def heights(self, mask: Array | None = None) -> Array:
        """Heights (h, w) towards the viewer, a pixel being 1; up to a constant, see `surface_heights`."""
        return integrate(self.normals, mask)

    def summary(self) -> dict[str, Any]:
        """How many pixels have a normal, and how well the model explains them; None without any."""
        known = np.isfinite(self.normals[..., 0])
        some = bool(known.any())
        residual = float(np.sqrt(np.mean(self.residual[known] ** 2))) if some else None
        steps = float(np.mean(self.steps[known])) if some else None
        return {"pixels": known.size, "known": int(known.sum()), "residual_rms": residual, "steps_mean": steps}


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

    pictures       (k, h, w)        linear intensities, k >= 3 unless `start` is given: of fewer, the normals are those
                                    nearest to the start that explain them
    lights         k                of the pictures, in their order
    mask           (h, w) or None   pixels that are wanted
    albedo, gloss  whether to solve for the factor of the diffuse, and of the specular term
    saturation     intensity from which samples are not used
    shadow         intensity above ambient up to which samples are not used; None: 1 % of the diffuse term's
    start          (h, w, 3)        normals to start from, instead of the Lambertian solution
    threads        int >= 1         the answer is the same for every number
    Raises InputError naming the argument, the light or the pixel.
    """
    pictures = _pictures(pictures, len(lights), 1 if start is not None else 3)
    if start is None:
        _check_spread(np.array([light.direction for light in lights]))
    inside = np.ones(pictures.shape[1:], bool) if mask is None else np.asarray(mask).astype(bool)
    if inside.shape != pictures.shape[1:]:
        what = f"a mask of shape {inside.shape} for pictures of {pictures.shape[1:]}"
        raise InputError(what, "mask", "give one of their size")
    observed = np.ascontiguousarray(pictures.reshape(len(lights), -1)[:, inside.ravel()].T)
    dark = _DARK * model.diffuse * np.array([light.intensity for light in lights])
    limit = dark if shadow is None else number(shadow, "shadow")
    used = ((observed - model.ambient > limit) & (observed < saturation)).astype(np.uint8)
    problem = _Problem(observed, used, tuple(lights), model, (albedo, gloss), threads)
    found = problem.lambertian() if start is None else problem.started(np.asarray(start)[inside])
    found[used.sum(axis=1) < min(len(lights), max(3, 2 + albedo + gloss)), :3] = np.nan
    problem.solve(found)
    if start is None and model.specular > 0:
        problem.again(found)
    laid = np.full((*inside.shape, solver.ANSWERS), np.nan)
    found[np.isnan(found[:, 0])] = np.nan
    laid[inside] = found
    columns = (solver.OF_DIFFUSE, solver.OF_SPECULAR, solver.RESIDUAL, solver.STEPS)
    return Normals(laid[..., :3].copy(), *(laid[..., column].copy() for column in columns))


@dataclass(frozen=True, eq=False)
class _Problem:
    """Pixels to be solved: intensities (n, k), which of them are used, and what for.

    fits  whether the factors of the diffuse and of the specular term are unknown
    """

    observed: Array
    used: Array
    lights: tuple[PhotometricLight, ...]
    model: SurfaceModel
    fits: tuple[bool, bool]
    threads: int

    def started(self, normals: Array) -> Array:
        """Answers to improve: these normals (n, 3), and factors of 1."""
        found = np.zeros((len(self.observed), solver.ANSWERS))
        found[:, :3], found[:, solver.OF_DIFFUSE : solver.OF_SPECULAR + 1] = normals, 1.0
        return found

    def lambertian(self) -> Array:
        """Start from the matt surface that explains the darkest usable samples; NaN where there is none.

        Three samples, unless their lights lie nearly in a plane: then one more, and so on.
        """
        directions = np.array([light.direction for light in self.lights])
        strengths = self.model.diffuse * np.array([light.intensity for light in self.lights])
        lit = (self.observed - self.model.ambient) / strengths
        order, usable = np.argsort(np.where(self.used > 0, lit, np.inf), axis=1), self.used.sum(axis=1)
        answer = np.full((len(lit), 3), np.nan)
        for size in range(3, len(self.lights) + 1):
            chosen, open_ = np.sort(order[:, :size], axis=1), np.isnan(answer[:, 0]) & (usable >= size)
            for subset in map(list, combinations(range(len(self.lights)), size) if open_.any() else ()):
                spans = np.linalg.svd(directions[subset], compute_uv=False)
                if spans[2] >= _FLAT * spans[0]:
                    mine = open_ & (chosen == subset).all(axis=1)
                    answer[mine] = lit[mine][:, subset] @ np.linalg.pinv(directions[subset]).T
        length = np.linalg.norm(answer, axis=1)
        with np.errstate(invalid="ignore"):
            found = self.started(np.where(length[:, None] > 0, answer / length[:, None], np.nan))
        if self.fits[0]:
            found[:, solver.OF_DIFFUSE] = length
        return found

    def solve(self, found: Array, some: Array | slice = slice(None)) -> None:
        """Improve answers, of some of the pixels, by tiles."""
        kernel, numbers, formula = self.model.kernel(), np.zeros(solver.NUMBERS), self.model.formula
        numbers[: solver.SPECULAR + 1] = self.model.ambient, self.model.diffuse, self.model.specular
        numbers[solver.IS_HALF], numbers[solver.FORM] = formula.space == "half", solver.FORMS[formula.lambda_form]
        numbers[solver.FITS_DIFFUSE : solver.FITS_SPECULAR + 1] = self.fits
        numbers[solver.MOST], numbers[solver.ENOUGH] = _MOST_STEPS, _ENOUGH
        arguments = solver_rows(self.lights), numbers, (kernel.coefficients, kernel.table)
        observed, used = self.observed[some], self.used[some]

        def tile(first: int) -> None:
            part = slice(first, first + TILE)
            solver.solve_pixels(kernel.address, observed[part], used[part], *arguments, found[part])

        tile(len(observed))  # compiled here, once
        starts = range(0, len(observed), TILE)
        if self.threads == 1 or len(starts) < 2 or jit.DISABLED:
            for first in starts:
                tile(first)
        else:
            with ThreadPoolExecutor(min(self.threads, len(starts))) as pool:
                list(pool.map(tile, starts))

    def again(self, found: Array) -> None:
        """Pixels that the model does not explain start once more from each light's highlight; the best answer stays.

        From a start beyond a highlight's flank, steps may end in a local minimum.
        """
        for half in solver_rows(self.lights)[:, solver.HALF : solver.HALF + 3]:
            with np.errstate(invalid="ignore"):
                poor = np.flatnonzero(found[:, solver.RESIDUAL] > _POOR * self.model.diffuse)
            if not len(poor):
                return
            tried = self.started(half)[poor]
            self.solve(tried, poor)
            better = tried[:, solver.RESIDUAL] < found[poor, solver.RESIDUAL]
            tried[:, solver.STEPS] += found[poor, solver.STEPS]
            found[poor[better]] = tried[better]


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
    bad = np.argwhere(~(np.abs(pictures) <= _BRIGHTEST))
    if len(bad):
        k, row, column = bad[0].tolist()
        what = f"column {column} of row {row} is not finite, or beyond {_BRIGHTEST:g}"
        raise InputError(what, f"pictures[{k}]", "scale the pictures, or mend the file")
    return pictures


def _check_spread(directions: Array) -> None:
    """Refuse lights in a plane: a normal's part across it would be unknown."""
    spans = np.linalg.svd(directions, compute_uv=False)
    if spans[-1] >= _FLAT * spans[0]:
        return
    cosines = np.abs(directions @ directions.T) - np.eye(len(directions))
    one, other = sorted(int(i) for i in np.unravel_index(np.argmax(cosines), cosines.shape))
    what = f"lights {one} and {other} are parallel" if cosines.max() > 1 - _FLAT**2 else "all lights lie in a plane"
    raise InputError(what, f"lights[{other}]", "move one of them: three directions out of a plane are needed")
