"""What a scene's objects are built into is built once, and lives as long as the scenes that share them."""

import gc
import pickle
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Barrier

import numpy as np
import pytest

from phongbench.errors import InputError
from phongbench.scenes import geometry as module
from phongbench.scenes.geometry import geometry
from phongbench.scenes.render import render
from phongbench.scenes.scene import Mesh, Scene
from phongbench.shading.lighting import Light

Written = Callable[[str], Scene]
MESH = """
[[objects]]
shape = "mesh"
surface = "icosphere"
degrees = 20
material = "white"
translate = [1.5, 0.5, 1.0]
scale = 0.4
"""


@pytest.fixture
def meshed(small: str, written: Written) -> Scene:
    """The small scene and a ball of triangles."""
    return written(small + MESH)


def test_pictures_of_one_scene_share_its_geometry_and_are_the_same_bits(meshed: Scene) -> None:
    first = render(meshed).picture
    built = geometry(meshed)
    assert geometry(meshed) is built
    assert np.array_equal(render(meshed).picture, first)
    again = replace(meshed, objects=(*meshed.objects,))  # another tuple: nothing is known of it
    assert geometry(again) is not built
    assert np.array_equal(render(again).picture, first)


def test_a_scene_with_other_materials_or_settings_is_not_built_anew(meshed: Scene) -> None:
    built = geometry(meshed)
    assert geometry(meshed.exact()) is built
    assert geometry(replace(meshed, picture=replace(meshed.picture, size=(9, 9)), lights=())) is built


def test_a_scene_with_other_objects_is(meshed: Scene) -> None:
    built = geometry(meshed)
    raw = tuple(replace(thing, unit=False) if isinstance(thing, Mesh) else thing for thing in meshed.objects)
    other = replace(meshed, objects=raw)
    assert (geometry(other).modes != built.modes).all()
    assert geometry(meshed) is built


def test_other_lights_are_measured_anew(meshed: Scene) -> None:
    """The ledger's bounds know how near each light is to a surface."""
    near, far = (replace(meshed, lights=(Light(position=(0.0, y, 0.0), attenuation=(0, 0, 1)),)) for y in (2.0, 9.0))
    bounds = [render(s, size=(8, 8)).ledger[3].bound for s in (near, far, near)]
    assert bounds[0] > bounds[1]
    assert bounds[0] == bounds[2]


def test_threads_that_ask_at_once_get_one_geometry(meshed: Scene) -> None:
    start = Barrier(4)

    def ask(_: int) -> int:
        start.wait()
        return id(geometry(meshed))

    with ThreadPoolExecutor(4) as pool:
        assert len(set(pool.map(ask, range(4)))) == 1


def test_a_scene_travels_to_another_process_without_what_was_built(meshed: Scene) -> None:
    first = render(meshed).picture
    arrived = pickle.loads(pickle.dumps(meshed))
    assert arrived.cache.objects is arrived.objects
    assert geometry(arrived) is not geometry(meshed)
    assert np.array_equal(render(arrived).picture, first)


def test_what_cannot_be_built_is_not_kept(meshed: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(module, "MOST_TRIANGLES", 3)
        with pytest.raises(InputError, match="triangles"):
            geometry(meshed)
    assert geometry(meshed).corners.shape[1] > 3


def test_geometry_is_dropped_with_the_last_scene_that_shows_it(small: str, written: Written) -> None:
    scene = written(small + MESH)
    built = weakref.ref(geometry(scene))
    other = replace(scene, background=(0.0, 0.0, 0.0))
    del scene
    gc.collect()
    assert built() is geometry(other)
    del other
    gc.collect()
    assert built() is None
