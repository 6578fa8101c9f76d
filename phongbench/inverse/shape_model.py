"""Heights from one picture and prior shapes: principal components of depth maps, fitted under the full model.

    height = mean + sum_k a_k component_k,    a_k normal with mean 0 and variance v_k

A picture has one equation a pixel, which leaves a cone of normals around the light; only shapes of the learnt
population can come out. The most probable coefficients are those of least squares, over the pixels' differences in
units of the noise and the coefficients in units of their deviations. Derivatives are analytic but for the highlight's
own, a difference quotient. Heights are towards the viewer, a pixel is 1; x right, y up, z to the viewer.

Source  Atick, Griffin and Redlich 1996, Neural Computation 8(6), for components as prior shapes
"""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas.lambda_forms import deficit_of_angle
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel, solver_rows
from phongbench.support.atomic_files import write_bytes
from phongbench.support.user_paths import reading

#: step of the difference quotient over the cosine, and evaluations of the fit at most
_STEP, _MOST = 1e-7, 200


@dataclass(frozen=True, eq=False)
class ShapeModel:
    """A population of heights: mean (h, w), components (k, h, w) of length 1, variances (k,) of their coefficients."""

    mean: Array
    components: Array
    variances: Array

    def heights(self, coefficients: Array) -> Array:
        """The member with these coefficients (k,)."""
        return np.asarray(self.mean + np.tensordot(coefficients, self.components, 1))


def learn(depths: Any, components: int) -> ShapeModel:
    """The principal components of depth maps (m, h, w), by singular values of what differs from their mean.

    Raises InputError for maps that are not finite, and for more components than m - 1, the most that m maps tell.
    """
    maps = np.asarray(depths, dtype=np.float64)
    if maps.ndim != 3 or min(maps.shape) < 2:
        raise InputError(f"depth maps of shape {maps.shape}", "depths", "give (maps, height, width), 2 or more of each")
    bad = np.flatnonzero(~np.isfinite(maps).all(axis=(1, 2)))
    if len(bad):
        raise InputError("a height is not finite", f"depths[{int(bad[0])}]", "leave the map out, or fill it")
    if not 1 <= components < len(maps):
        fix = f"{len(maps)} maps tell 1 to {len(maps) - 1} components"
        raise InputError(f"{components} components of {len(maps)} depth maps", "components", fix)
    mean = maps.mean(axis=0)
    _, spread, axes = np.linalg.svd((maps - mean).reshape(len(maps), -1), full_matrices=False)
    variances = spread[:components] ** 2 / (len(maps) - 1)
    return ShapeModel(mean, axes[:components].reshape(-1, *mean.shape), variances)


def synthetic_heads(count: int, size: int = 64, seed: int = 0) -> Array:
    """Depth maps (count, size, size) of synthetic heads: an ellipsoid with brow, nose and chin, of random sizes.

    No face is behind them: a program makes them, to try a prior with.
    """
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[1 : -1 : size * 1j, -1 : 1 : size * 1j]
    heads = []
    for _ in range(count):
        wide, tall, deep, nose, tip, brow, chin, low = rng.normal(1.0, 0.12, 8)
        head = deep * np.sqrt(np.maximum(2.2 - (x / wide) ** 2 - (y / (1.1 * tall)) ** 2, 0.05))
        head += 0.22 * nose * np.exp(-((x / 0.16) ** 2 + ((y - 0.1 + 0.3 * (tip - 1)) / (0.3 * tip)) ** 2))
        head += 0.1 * brow * np.exp(-((x / 0.6) ** 2 + ((y - 0.55) / 0.15) ** 2))
        head += 0.14 * chin * np.exp(-((x / 0.3) ** 2 + ((y + 0.75 * low) / 0.18) ** 2))
        heads.append(head * size / 2)
    return np.array(heads)


def normals_of(heights: Array) -> Array:
    """Unit normals (h, w, 3) of heights (h, w), by central differences."""
    over_y, over_x = np.gradient(heights)
    normals = np.dstack([-over_x, over_y, np.ones_like(heights)])
    return np.asarray(normals / np.linalg.norm(normals, axis=2)[..., None])


def cone(picture: Array, light: PhotometricLight, model: SurfaceModel) -> Array:
    """Half the angle in degrees, for each pixel, of the cone of normals around the light; NaN where none is lit.

    Of a matt surface: a highlight's normals lie on no cone, InputError.
    """
    if model.specular:
        raise InputError("with a highlight, normals lie on no cone", "ks", "leave --ks out, or give --prior pca")
    cosine = (np.asarray(picture, np.float64) - model.ambient) / (model.diffuse * light.intensity)
    return np.degrees(np.arccos(np.where((cosine > 0) & (cosine <= 1), cosine, np.nan)))


@dataclass(frozen=True, eq=False)
class Fit:
    """The most probable shape: heights (h, w), its coefficients, how far the picture is off (rms), evaluations."""

    heights: Array
    coefficients: Array
    residual: float
    evaluations: int


def fit(
    picture: Array,
    shapes: ShapeModel,
    light: PhotometricLight,
    model: SurfaceModel,
    noise: float = 0.01,
    *,
    weighed: bool = True,
) -> Fit:
    """The shape whose shading is nearest to a picture (h, w) of linear intensities.

    noise    standard deviation of intensities, against which the prior is weighed, > 0
    weighed  whether coefficients have their prior; else every one is as probable
    """
    from scipy.optimize import least_squares

    picture = np.asarray(picture, np.float64)
    if picture.shape != shapes.mean.shape:
        (h, w), fits = picture.shape, shapes.mean.shape
        raise InputError(f"{w} x {h} pixels for shapes of {fits[1]} x {fits[0]}", "picture", "cut or scale the picture")
    if not np.isfinite(picture).all():
        row, column = np.argwhere(~np.isfinite(picture))[0].tolist()
        raise InputError(f"column {column} of row {row} is not finite", "picture", "mend the file")
    if not 0 < noise < np.inf:
        raise InputError(f"a noise of {noise:g}", "noise", "give a standard deviation above 0, e.g. 0.01")
    shader = _Shader(shapes, light, model)
    deviations = np.sqrt(np.maximum(shapes.variances, np.finfo(float).tiny))

    def differences(scaled: Array) -> Array:
        return np.concatenate([(shader.shade(scaled * deviations)[0] - picture.ravel()) / noise, weighed * scaled])

    def derivatives(scaled: Array) -> Array:
        changes = shader.shade(scaled * deviations)[1] * deviations / noise
        return np.concatenate([changes, weighed * np.eye(len(scaled))])

    # "lm" takes a third of the time of the default, whose decompositions start threads for these narrow matrices
    best = least_squares(differences, np.zeros(len(deviations)), derivatives, method="lm", max_nfev=_MOST)
    coefficients = best.x * deviations
    residual = float(np.sqrt(np.mean((shader.shade(coefficients)[0] - picture.ravel()) ** 2)))
    return Fit(shapes.heights(coefficients), coefficients, residual, int(best.nfev))


class _Shader:
    """Intensities (n,) of a shape's pixels, and their derivatives (n, k) by the coefficients."""

    def __init__(self, shapes: ShapeModel, light: PhotometricLight, model: SurfaceModel) -> None:
        stack = np.concatenate([shapes.mean[None], shapes.components])
        over_y, over_x = np.gradient(stack, axis=(1, 2))
        self.slopes = np.stack([over_x, -over_y], axis=-1).reshape(len(stack), -1, 2)
        row = solver_rows([light])[0]
        self.light, self.half, self.strength = row[:3], row[3:6], light.intensity
        self.model, self.kernel = model, model.kernel()

    def shade(self, coefficients: Array) -> tuple[Array, Array]:
        slopes = self.slopes[0] + np.tensordot(coefficients, self.slopes[1:], 1)
        length = np.sqrt(1 + (slopes**2).sum(axis=1))
        normals = np.column_stack([-slopes, np.ones(len(slopes))]) / length[:, None]
        facing = normals @ self.light
        lit = facing > 0
        highlight, bend, towards = self._highlight(normals, facing, lit)
        value = self.strength * (self.model.diffuse * np.maximum(facing, 0) + self.model.specular * highlight)
        by_normal = self.strength * (
            self.model.diffuse * lit[:, None] * self.light + self.model.specular * bend[:, None] * towards
        )
        # of N = (-p, -q, 1) / s: dN/dp = (-1, 0, 0) / s - N p / s^2, and likewise for q
        along = (by_normal * normals).sum(axis=1)[:, None]
        by_slope = -by_normal[:, :2] / length[:, None] - along * slopes / (length**2)[:, None]
        return self.model.ambient + value, np.einsum("nc,knc->nk", by_slope, self.slopes[1:])

    def _highlight(self, normals: Array, facing: Array, lit: Array) -> tuple[Array, Array, Array]:
        """The formula's value, its derivative by the cosine, and that of the cosine by the normal."""
        form = self.model.formula.lambda_form
        if self.model.formula.space == "half":
            cosine, towards = normals @ self.half, np.broadcast_to(self.half, normals.shape)
        else:
            cosine = 2 * facing * normals[:, 2] - self.light[2]
            towards = 2 * normals[:, 2:] * self.light + 2 * facing[:, None] * np.array([0.0, 0.0, 1.0])
        gate = np.where(lit, cosine, 0.0)
        values = []
        for x in (cosine, cosine - _STEP):
            coordinate = x if form == "none" else deficit_of_angle(form, x)
            values.append(self.kernel.values(np.ascontiguousarray(coordinate), gate))
        return values[0], (values[0] - values[1]) / _STEP, towards


def read_depths(path: Path) -> Array:
    """Depth maps (m, h, w): the only array of a .npz, or the .npy files (h, w) of a folder, by name."""
    with reading(path, "depth maps", "give a folder of .npy files, or a .npz with one array (maps, height, width)"):
        files = sorted(path.glob("*.npy")) if path.is_dir() else [path]
        if not files:
            raise InputError("no .npy file in the folder", str(path), "give a depth map (height, width) in each")
        maps = [_arrays(file) for file in files]
    if not path.is_dir():
        return np.asarray(maps[0])
    for file, one in zip(files, maps, strict=True):
        if one.shape != maps[0].shape:
            raise InputError(f"{one.shape}, but {files[0].name} has {maps[0].shape}", str(file), "give one size")
        if not np.isfinite(one).all():
            raise InputError("a height is not finite", str(file), "leave the map out, or fill it")
    return np.stack(maps)


def _arrays(path: Path, *names: str) -> Any:
    """The arrays of a file, those of these names, or the only one."""
    try:
        with io.BytesIO(path.read_bytes()) as data:
            loaded = np.load(data, allow_pickle=False)
            if isinstance(loaded, np.ndarray):
                loaded = {"depths": loaded}
            found = [np.asarray(loaded[name], np.float64) for name in (names or list(loaded)[:1])]
    except (ValueError, KeyError, EOFError, IndexError, TypeError) as problem:
        raise InputError(f"not what is asked for: {problem}", str(path), "`inverse learn` writes shapes") from problem
    return found if names else found[0]


def save_shapes(shapes: ShapeModel, path: Path) -> None:
    """Write a .npz of mean, components and variances."""
    if path.suffix.lower() != ".npz":
        raise InputError(f"shapes are not written as {path.suffix or path.name}", str(path), "use .npz")
    data = io.BytesIO()
    np.savez(data, mean=shapes.mean, components=shapes.components, variances=shapes.variances)
    write_bytes(path, data.getvalue())


def read_shapes(path: Path) -> ShapeModel:
    """The shapes of a .npz that `save_shapes` wrote; InputError for other files."""
    with reading(path, "shapes", "give the .npz that `phongbench inverse learn` writes"):
        mean, components, variances = _arrays(path, "mean", "components", "variances")
    if mean.ndim != 2 or components.shape != (len(variances), *mean.shape) or not np.isfinite(components).all():
        raise InputError("mean, components and variances do not fit", str(path), "learn the shapes again")
    return ShapeModel(mean, components, variances)
