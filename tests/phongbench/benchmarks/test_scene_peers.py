"""Other people's renderers: the same scene in their words, honest absences, and pictures that are the same."""

import math
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from phongbench.benchmarks import mitsuba, numpy_tracer, pyvista, scene_bench
from phongbench.benchmarks.scene_peers import BOARD, PEERS, SHARPEST, Entry, Peer, Wishes, agreement
from phongbench.errors import MeasurementError
from phongbench.scenes.scene import Plane, Scene, Sphere
from phongbench.scenes.scene_files import read_scene

Array = Any
SIZE = (48, 32)

#: a peer that draws what the plain tracer draws, in bytes or in floats
TWIN = """
import numpy as np
from phongbench.benchmarks import numpy_tracer
from phongbench.benchmarks.scene_peers import Drawing

def drawing(scene, wishes):
    print("I greet everybody on stdout")
    def draw():
        picture = numpy_tracer.trace(scene, size=wishes.size, depth=wishes.depth, shadows=wishes.shadows)[0]
        return np.round(255 * np.minimum(picture, 1)).astype(np.uint8) if BYTES else picture
    return Drawing("7.1", draw, lambda: numpy_tracer.distances(scene, wishes.size))
"""
MISSING = "import drawing_for_nobody"
ABORTS = """
import os, sys

def drawing(scene, wishes):
    print("LLVM ERROR: no", file=sys.stderr, flush=True)
    os.abort()
"""
RAISES = "def drawing(scene, wishes):\n    raise RuntimeError('no window\\nat all')"
BREAKS = "def drawing(scene, wishes):\n    return {}['key']"
#: ends when it draws for the third time: in the second round
TIRES = TWIN.replace("    def draw():", "    left = [None] * 2\n    def draw():\n        left.pop()").replace(
    "BYTES", "False"
)


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Entry]:
    """Peers whose module is this text."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def make(text: str, **what: Any) -> Entry:
        name = f"peer_{len(list(tmp_path.iterdir()))}_of_{tmp_path.name}"
        (tmp_path / f"{name}.py").write_text(text)
        return Entry(name, "a drum", what.pop("mirrors", True), "it is a test", **what)

    return make


@pytest.fixture
def small_scene(small: str, written: Callable[[str], Scene]) -> Scene:
    return written(small)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MISSING, "not installed; pip install drawing_for_nobody brings it"),
        (ABORTS, "cannot be used here: it ended with exit code -6: LLVM ERROR: no; it needs a drum"),
        (RAISES, "cannot be used here: no window; it needs a drum"),
        (BREAKS, "cannot be used here: it ended with exit code 1: KeyError: 'key'; it needs a drum"),
    ],
)
def test_a_peer_that_cannot_draw_says_why(
    made: Callable[..., Entry], small_scene: Scene, text: str, words: str
) -> None:
    with pytest.raises(MeasurementError) as caught:
        Peer("drawing_for_nobody", made(text), small_scene, Wishes(SIZE, 1, True))
    assert caught.value.what == words


def test_who_draws_less_is_compared_with_ours_drawing_as_little(
    made: Callable[..., Entry], small_scene: Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    peers = {
        "bytes": made(TWIN.replace("BYTES", "True"), mirrors=False, brightest=1.0),
        "nobody": made(MISSING),
        "floats": made(TWIN.replace("BYTES", "False")),
    }
    rows, absent = scene_bench.tracers(small_scene, rounds=2, size=SIZE, depth=2, shadows=True, peers=peers)
    assert [row["why"] for row in absent] == ["cannot be imported: No module named 'drawing_for_nobody'"]
    full, direct = "depth 2, shadows", "depth 0, no shadows"
    assert [(row["tracer"], row["draws"]) for row in rows] == [
        (scene_bench.OURS, full),
        (scene_bench.PLAIN, full),
        ("floats", full),
        (scene_bench.OURS, direct),
        ("bytes", direct),
    ]
    by = {row["tracer"]: row for row in rows}
    assert by["floats"]["largest_difference"] == pytest.approx(by[scene_bench.PLAIN]["largest_difference"], abs=1e-3)
    for name in ("floats", "bytes"):
        assert by[name]["surfaces_agree"] == 1
        assert by[name]["pixels_off"] < 0.02
        assert (by[name]["version"], by[name]["note"]) == ("7.1", "it is a test")
        assert by[name]["mpixels_per_second"] == pytest.approx(math.prod(SIZE) / by[name]["seconds"] / 1e6, rel=0.1)
    assert rows[0]["ratio"] == rows[3]["ratio"] == 1
    assert not capfd.readouterr().out


def test_who_fails_on_the_way_leaves_the_others_alone(made: Callable[..., Entry], small_scene: Scene) -> None:
    rows, absent = scene_bench.tracers(small_scene, rounds=2, size=SIZE, peers={"tired": made(TIRES)})
    assert [row["tracer"] for row in rows] == [scene_bench.OURS, scene_bench.PLAIN]
    assert "IndexError: pop from empty list" in absent[0]["why"]


def test_agreement_counts_distances_and_nothing() -> None:
    ours = np.array([[1.0, 1.0, np.inf, np.inf, 2.0, 4.0]])
    theirs = np.array([[1.005, 1.02, np.inf, 3.0, np.inf, 4.0]])
    assert agreement(ours, theirs) == 0.5


def _points(plane: Plane, seed: int) -> tuple[Array, Array]:
    """Places on a plane, and which wear the second material; none so near to a line that rounding decides."""
    rng = np.random.default_rng(seed)
    across, along = mitsuba.axes(plane)
    assert plane.pattern is not None
    steps = rng.integers(-40, 40, (500, 2)) + rng.uniform(0.01, 0.99, (500, 2))
    points = plane.point + plane.pattern.side * (steps @ np.stack([across, along]))
    return points, numpy_tracer._odd(plane, points)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.48, 0.6, 0.64)])
def test_the_squares_of_a_board_are_where_ours_are(small_scene: Scene, normal: tuple[float, float, float]) -> None:
    pattern = small_scene.of(Plane)[0].pattern
    plane = Plane((0.5, -0.25, 2.0), normal, 0, pattern)
    points, odd = _points(plane, 3)
    found = mitsuba._shape(plane, small_scene.materials)
    places = np.linalg.solve(found["to_world"], np.c_[points, np.ones(len(points))].T)[:2].T  # -1 .. 1 on the rectangle
    assert np.abs(places).max() < 1
    u, v = (((places + 1) / 2 * BOARD) % 1 > 0.5).T
    assert np.array_equal(u != v, odd)
    for parity in (0, 1):
        quad = pyvista._quad(plane, (parity,))
        sides = np.stack([quad.corners[1] - quad.corners[0], quad.corners[3] - quad.corners[0]])
        shares = (points - quad.corners[0]) @ np.linalg.pinv(sides)
        texels = quad.places[0] + shares * (quad.places[2] - quad.places[0])
        column, row = ((texels % 1) * 2).astype(int).T
        opaque = quad.shown[::-1][row, column, 3] == 255
        assert np.array_equal(opaque, odd == parity)


def test_a_plane_without_squares_is_one_surface(small_scene: Scene) -> None:
    plane = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1)
    assert (pyvista._quad(plane, (0, 1)).shown == 255).all()
    assert mitsuba._shape(plane, small_scene.materials)["reflectivity"] == {"type": "uniform", "value": 0.6}


def test_mitsubas_camera_looks_where_ours_does(small_scene: Scene) -> None:
    told = mitsuba.described(small_scene, SIZE)["sensor"]
    width, height = SIZE
    half = math.tan(math.radians(told["fov"]) / 2)
    y, x = np.mgrid[0:height, 0:width] + 0.5
    # its camera looks along z, x to the left and y up
    local = np.stack(
        [(1 - 2 * x / width) * half * width / height, (1 - 2 * y / height) * half, np.ones_like(x)], axis=2
    )
    towards = local @ told["to_world"][:3, :3].T
    towards /= np.linalg.norm(towards, axis=2, keepdims=True)
    assert np.allclose(towards, numpy_tracer.directions(small_scene.camera, *SIZE), atol=1e-12)
    assert np.allclose(told["to_world"][:3, 3], small_scene.camera.position)


def test_every_object_wears_its_material() -> None:
    scene = read_scene("chequerboard")
    told = mitsuba.described(scene, SIZE)
    looks = {thing.centre: look for thing, look in pyvista.described(scene) if isinstance(thing, Sphere)}
    for index, thing in enumerate(scene.objects):
        if not isinstance(thing, Sphere):
            continue
        material, shape = scene.materials[thing.material], told[f"object{index}"]
        assert (tuple(shape["center"]), shape["radius"]) == (thing.centre, thing.radius)
        for name in mitsuba.COLOURS:
            assert shape[name]["color"] == list(getattr(material.reflection, name))
        assert shape["shininess"]["value"] == material.reflection.shininess
        assert shape["reflectivity"]["value"] == material.reflectivity
        look, k = looks[thing.centre], material.reflectivity
        assert look.diffuse == pytest.approx((1 - k) * np.array(material.reflection.diffuse))
        assert look.ambient == pytest.approx((1 - k) * np.multiply(material.reflection.ambient, scene.ambient_light))
        assert look.power == min(material.reflection.shininess, SHARPEST)


@pytest.mark.parametrize("name", PEERS)
def test_an_installed_peer_draws_the_same_picture(name: str) -> None:
    if find_spec(name) is None:
        pytest.skip(f"{name} is not installed")
    rows, absent = scene_bench.tracers(
        read_scene("chequerboard"), rounds=1, size=(192, 108), depth=3, shadows=True, peers={name: PEERS[name]}
    )
    if absent:
        pytest.skip(absent[0]["why"])
    assert rows[-1]["tracer"] == name
    assert rows[-1]["surfaces_agree"] > 0.995
    assert rows[-1]["pixels_off"] < 0.03
