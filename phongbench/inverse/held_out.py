"""How well shapes that were learnt give back others of their population, each from one picture.

A picture is drawn by exact Phong, with noise, and the shape is fitted to it by `shape_model.fit`: with the prior on
coefficients, without it, which leaves the components alone, and not at all, which is the mean shape.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.inverse.shape_model import ShapeModel, fit, learn, normals_of
from phongbench.inverse.surface_model import PhotometricLight, SurfaceModel
from phongbench.inverse.surfaces import degrees_between

#: how the pictures are drawn, and the standard deviation of their noise
LIGHT = PhotometricLight.of((0.4, 0.3, 1.0))
MODEL = SurfaceModel(ambient=0.05, diffuse=0.7, specular=0.2, alpha=20.0)
NOISE = 0.05
#: what is compared: the fit with the prior, without it, and the mean shape
WAYS = ("prior", "components", "mean")


def learn_and_try(maps: Array, components: int, apart: int) -> tuple[ShapeModel, pd.DataFrame]:
    """The shapes of all depth maps (m, h, w) but the last `apart`, and the recovery of those.

    Raises InputError for too few maps; see `learn`.
    """
    if not 0 <= apart < len(maps):
        fix = f"hold out fewer: of {len(maps)} maps, components are learnt from the others"
        raise InputError(f"{apart} maps held out of {len(maps)}", "held_out", fix)
    kept = len(maps) - apart
    shapes = learn(maps[:kept], components)
    bad = np.flatnonzero(~np.isfinite(maps[kept:]).all(axis=(1, 2)))
    if len(bad):
        raise InputError("a height is not finite", f"depths[{kept + int(bad[0])}]", "leave the map out, or fill it")
    return shapes, recovery(shapes, maps[kept:])


def recovery(shapes: ShapeModel, maps: Array, seed: int = 0) -> pd.DataFrame:
    """A row for each depth map (m, h, w), none of which the shapes were learnt from.

    map                 its number
    {way}_degrees       mean angle between its normals and those found, for each of WAYS
    {way}_depth_rmse    root of the mean squared difference of heights but for a constant, over the map's span
    """
    return pd.DataFrame([{"map": k} | dict(_row(shapes, one, [seed, k])) for k, one in enumerate(maps)])


def ratio(rows: pd.DataFrame) -> float:
    """The mean angular error with the prior over that of the mean shape."""
    return float(rows["prior_degrees"].mean() / rows["mean_degrees"].mean())


def drawn(heights: Array, seed: Any) -> Array:
    """The picture (h, w) of heights, by exact Phong under LIGHT and MODEL, with noise."""
    normals, towards = normals_of(heights), np.array(LIGHT.direction)
    facing = normals @ towards
    mirrored = np.maximum(2 * facing * normals[..., 2] - towards[2], 0.0)
    shine = np.where(facing > 0, mirrored**MODEL.alpha, 0.0)
    picture = MODEL.ambient + MODEL.diffuse * np.maximum(facing, 0.0) + MODEL.specular * shine
    return np.asarray(picture + np.random.default_rng(seed).normal(0.0, NOISE, picture.shape))


def _row(shapes: ShapeModel, truth: Array, seed: Any) -> Iterator[tuple[str, float]]:
    picture = drawn(truth, seed)
    found = {
        "prior": fit(picture, shapes, LIGHT, MODEL, NOISE).heights,
        "components": fit(picture, shapes, LIGHT, MODEL, NOISE, weighed=False).heights,
        "mean": shapes.mean,
    }
    for way in WAYS:
        yield f"{way}_degrees", float(degrees_between(normals_of(found[way]), normals_of(truth)).mean())
        yield f"{way}_depth_rmse", float(np.std(found[way] - truth) / max(np.ptp(truth), np.finfo(float).tiny))
