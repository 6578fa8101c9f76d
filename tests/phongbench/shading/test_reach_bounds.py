"""What shading says that a colour may have lost is no less than what it lost."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.scenes.render import render
from phongbench.scenes.scene_files import read_scene
from phongbench.scenes.skip_bounds import Bounds
from phongbench.scenes.skips import SceneSkips, Tally
from phongbench.shading import tiles
from phongbench.shading.lighting import Light, Material, Skips, Viewer
from phongbench.shading.prepared import PreparedShading

MATERIAL = Material((0.1, 0.1, 0.1), (0.6, 0.5, 0.4), (0.3, 0.5, 0.7), 12.0)


def patch(rng: np.random.Generator, count: int, wide: float) -> tuple[Any, Any]:
    """Points of a piece of ground or of a ball of random curvature, and their unit normals."""
    flat = rng.uniform(-wide, wide, (count, 2))
    bend = rng.uniform(0, 1 / wide)
    points = np.column_stack([flat[:, 0], -bend * (flat**2).sum(axis=1), flat[:, 1]])
    normals = np.column_stack([2 * bend * flat[:, 0], np.ones(count), 2 * bend * flat[:, 1]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points.astype(np.float32), normals.astype(np.float32)


def lamps(rng: np.random.Generator, count: int, reach: float | None) -> list[Light]:
    """Lights around the patch, of all colours, each with an attenuation of its own."""
    places = rng.normal((0, 4, 0), 6, (count, 3))
    fades = rng.uniform(0.01, 0.5, (count, 3)) * rng.integers(0, 2, (count, 3)) + (0.01, 0, 0)
    shine = rng.uniform(0, 1, (count, 3, 3))
    return [
        Light(position=p, attenuation=f, diffuse=d, specular=s, ambient=a, reach=reach)
        for p, f, (d, s, a) in zip(places, fades, shine, strict=True)
    ]


def shaded(points: Any, normals: Any, lights: list[Light], skips: Skips) -> tuple[Any, Any]:
    """Colours, and the losses that were told."""
    colours, lost = np.empty_like(points), np.zeros(1, np.float32)
    shading = PreparedShading(MATERIAL, lights, Viewer(position=(0.0, 5.0, 8.0)), skips=skips, normalise=False)
    shading.shade(points, normals, colours, np.zeros(tiles.COUNTS, np.int64), lost)
    return colours.astype(float), lost


@given(st.integers(0, 2**32), st.integers(4, 30), st.floats(0.5, 12), st.floats(0.01, 5))
@settings(max_examples=40, deadline=None)
def test_lights_out_of_reach_would_have_added_no_more_than_is_told(seed: int, count: int, reach: float, wide: float):
    rng = np.random.default_rng(seed)
    points, normals = patch(rng, 700, wide)
    lights = lamps(rng, count, reach)
    full, _ = shaded(points, normals, lights, replace(Skips(), reach=False))
    cut, lost = shaded(points, normals, lights, Skips())
    assert (full - cut).max() <= lost[0] * (1 + 1e-5) + 1e-5


@pytest.mark.parametrize("depth", [0, 1, 3])
def test_a_pictures_bound_holds_and_is_tighter_than_what_holds_anywhere(depth: int) -> None:
    scene = read_scene("many-lights")
    size = (96, 54)
    all_lights = replace(SceneSkips(), shading=replace(Skips(), reach=False))
    cut, full = (render(scene, size=size, depth=depth, skips=skips) for skips in (SceneSkips(), all_lights))
    line = next(line for line in cut.ledger if line.name == "out_of_reach")
    assert 0 < float(np.abs(full.picture - cut.picture).max()) <= line.bound
    assert line.bound < 0.6 * Bounds(scene).beyond_reach


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_losses_of_reflections_mix_as_their_light_does(told: list[tuple[float, float]]) -> None:
    """Two materials, k = 0.25 and 1: no path that bounces between them loses more than is told."""
    lost = np.array(told, np.float32)
    most = Tally(lost=lost).loss((0.25, 1.0))
    for seed in range(8):
        choice = np.random.default_rng(seed).integers(0, 2, len(told))
        path, weight = 0.0, 1.0
        for bounce, material in enumerate(choice):
            k = (0.25, 1.0)[material]
            path += weight * (1 - k) * float(lost[bounce, material])
            weight *= k
        assert path <= most + 1e-6
