"""Lights held constant over a block change a colour by no more than is told, and that by no more than is allowed."""

import math
import platform
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import InputError
from phongbench.formulas.formula import Specular
from phongbench.formulas.registry import REGISTRY
from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import Thrift, variants
from phongbench.shading.constant_patches import patch_loop
from phongbench.shading.lighting import Light, Material, Skips, Viewer
from phongbench.shading.shade import shade

Written = Callable[[str], Scene]
MATERIAL = Material((0.1, 0.1, 0.1), (0.6, 0.5, 0.4), (0.3, 0.5, 0.7), 12.0)
#: every formula, and one of them in every form
FORMULAS = [
    *(Specular(spec.name, None, 8 if spec.uses_gamma else None) for spec in REGISTRY.values()),
    *(Specular("lyon", form, 8) for form in REGISTRY["lyon"].lambda_forms[1:]),
]
#: what sums of thirty lights are rounded by
ROUNDING = 4e-6


def surface(rng: np.random.Generator, count: int, wide: float, bend: float) -> tuple[Any, Any]:
    """Points of a bent patch in strips of neighbours, and their unit normals."""
    flat = np.sort(rng.uniform(-wide, wide, (count, 2)), axis=0)
    points = np.column_stack([flat[:, 0], -bend * (flat**2).sum(axis=1), flat[:, 1]])
    normals = np.column_stack([2 * bend * flat[:, 0], np.ones(count), 2 * bend * flat[:, 1]])
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def lamps(rng: np.random.Generator, count: int) -> list[Light]:
    """Lights near and far, of all colours; every third far away in a direction."""
    found = []
    for n in range(count):
        colours: dict[str, Any] = {"diffuse": rng.uniform(0, 1, 3), "specular": rng.uniform(0, 1, 3)}
        place = rng.normal((0, 3, 0), 4, 3) * rng.choice((1.0, 5.0))
        fade = (0.5, 0.1 * rng.integers(0, 2), 0.05 * rng.integers(0, 2))
        found.append(Light(place, **colours) if n % 3 == 0 else Light(position=place, attenuation=fade, **colours))
    return found


@given(
    st.integers(0, 2**32),
    st.integers(1, 40),
    st.floats(1e-3, 2),
    st.floats(0, 1),
    st.floats(0.5, 1),
    st.sampled_from([1e-4, 2e-3, 0.05, 1.0]),
    st.sampled_from([Specular(), Specular("lyon", "cross", 8)]),
    st.booleans(),
)
@settings(max_examples=80, deadline=None)
def test_a_held_light_changes_no_colour_by_more_than_the_budget(
    seed: int, count: int, wide: float, bend: float, short: float, budget: float, formula: Specular, seen: bool
) -> None:
    """Flat and bent patches, unit and shorter normals, shadows or none."""
    rng = np.random.default_rng(seed)
    points, normals = surface(rng, 300, wide, bend)
    normals *= rng.uniform(short, 1, (300, 1))
    lights = lamps(rng, count)
    visible = np.repeat(rng.integers(0, 2, (count, 5)), 60, axis=1).astype(bool) if seen else None
    given: dict[str, Any] = {
        "material": MATERIAL,
        "lights": lights,
        "viewer": Viewer(position=(1.0, 3.0, 4.0)),
        "specular": formula,
        "normalise": False,
        "visible": visible,
    }
    vectors = points.astype(np.float32), normals.astype(np.float32)
    full = shade(*vectors, **given, skips=Skips.none()).colours.astype(float)
    held = shade(*vectors, **given, skips=replace(Skips.exact(), constant_patches=budget)).colours.astype(float)
    assert np.abs(held - full).max() <= budget + ROUNDING


@pytest.mark.parametrize("viewer", [Viewer(position=(0.5, 2.0, 3.0)), Viewer(direction=(0.3, 0.8, 0.5))])
@pytest.mark.parametrize("formula", FORMULAS, ids=lambda s: f"{s.approximation}-{s.lambda_form}")
def test_every_registered_formula_may_be_held(formula: Specular, viewer: Viewer) -> None:
    rng = np.random.default_rng(7)
    points, normals = (v.astype(np.float32) for v in surface(rng, 640, 0.6, 0.2))
    given: dict[str, Any] = {"material": MATERIAL, "lights": lamps(rng, 12), "viewer": viewer, "specular": formula}
    full = shade(points, normals, **given, skips=Skips.none()).colours.astype(float)
    for budget in (0.003, 0.3):
        done = shade(points, normals, **given, skips=replace(Skips.exact(), constant_patches=budget))
        assert done.ledger.constant_patches > 0
        assert 0 < np.abs(done.colours - full).max() <= budget + ROUNDING


def test_model_blinn_phong_may_be_held_too() -> None:
    rng = np.random.default_rng(8)
    points, normals = (v.astype(np.float32) for v in surface(rng, 640, 0.6, 0.2))
    given: dict[str, Any] = {
        "material": MATERIAL,
        "lights": lamps(rng, 12),
        "viewer": Viewer(position=(0.5, 2.0, 3.0)),
        "model": "blinn-phong",
    }
    full, held = (shade(points, normals, **given, skips=Skips(constant_patches=b)).colours for b in (0.0, 0.01))
    assert 0 < np.abs(held - full).max() <= 0.01 + ROUNDING


def test_a_formula_that_may_grow_is_not_held() -> None:
    rng = np.random.default_rng(9)
    points, normals = (v.astype(np.float32) for v in surface(rng, 640, 0.6, 0.2))
    registry = {**REGISTRY, "lyon": replace(REGISTRY["lyon"], falls=False)}
    done = shade(
        points,
        normals,
        material=MATERIAL,
        lights=lamps(rng, 12),
        viewer=Viewer(position=(0.5, 2.0, 3.0)),
        specular=Specular("lyon", "dot", 8),
        skips=Skips(constant_patches=0.5),
        registry=registry,
    )
    assert done.ledger.constant_patches == 0


@given(st.floats(5, 80), st.sampled_from([10.0, 50.0, 200.0]))
@settings(max_examples=25, deadline=None)
def test_the_farther_a_light_the_smaller_the_budget_that_holds_it(sides: float, alpha: float) -> None:
    """A square patch of side 1, light and viewer mirrored at so many sides: both turn by sqrt(1/2) / sides.

    By the lobe's steepest slope, below sqrt(alpha / e) everywhere, half the interval is at most that slope times both
    turns; the bounds' own rounding and second order are what the factor 1.5 leaves.
    """
    x, z = (v.ravel() - 0.5 for v in np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 8)))
    points = np.column_stack([x, np.zeros(64), z])
    normals = np.tile((0.0, 1.0, 0.0), (64, 1))
    slant = np.array((math.sin(0.5), math.cos(0.5), 0.0)) * sides
    given: dict[str, Any] = {
        "material": Material(specular=(1, 1, 1), shininess=alpha),
        "lights": [Light(position=slant)],
        "viewer": Viewer(position=slant * (-1, 1, 1)),
    }
    slope = math.sqrt(alpha / math.e)
    enough = 1.5 * slope * 2 * math.sqrt(0.5) / sides + 1e-3
    held = [
        shade(points, normals, **given, skips=replace(Skips.exact(), constant_patches=budget)).ledger.constant_patches
        for budget in (min(enough, 1.0), 1e-6)
    ]
    assert held == [64, 0]


@pytest.mark.skipif(
    jit.DISABLED or platform.machine().lower() not in ("x86_64", "amd64"), reason="reads x86 instructions"
)
def test_lights_are_estimated_on_whole_vectors() -> None:
    """One by one they cost more than most of them take at 64 points."""
    llvm, assembly = jit.code(patch_loop("reflect", "none", FLOAT32))
    assert re.search(r"\bvsqrtps\s.*[yz]mm", assembly)
    assert not re.search(r"\bdouble\b", llvm)


def test_a_budget_is_a_number_from_0_up() -> None:
    with pytest.raises(InputError, match="constant_patches"):
        Skips(constant_patches=-0.1)


# pictures


def line(done: Rendered) -> Any:
    """The ledger's line."""
    return next(line for line in done.ledger if line.name == "constant_patches")


@pytest.mark.parametrize("specular", [Specular(), Specular("lyon", "difference", 8)], ids=lambda s: s.approximation)
@pytest.mark.parametrize("name", examples())
def test_a_picture_changes_by_no_more_than_its_ledger_says(name: str, specular: Specular) -> None:
    scene = read_scene(name)
    exact = Thrift.exact()
    wishes: dict[str, Any] = {"size": (96, 54), "depth": 2, "supersampling": 2, "specular": specular}
    full = render(scene, thrift=exact, **wishes).picture
    for budget in (1 / 510, 0.3):
        thrift = replace(exact, shading=replace(exact.shading, constant_patches=budget))
        done = render(scene, thrift=thrift, **wishes)
        assert float(np.abs(done.picture - full).max()) <= line(done).bound * (1 + 1e-5) + ROUNDING
        assert line(done).bound <= budget * (1 + 1e-6)
    assert line(done).skipped > 0


def test_nothing_is_held_unless_somebody_asks(small: str, written: Written) -> None:
    scene = written(small)
    asked = written(small.replace("depth = 2", "depth = 2\nconstant_patches = 0.01"))
    assert line(render(scene)).skipped == 0
    assert line(render(asked)).skipped > 0
    for thrift in (Thrift.exact(), Thrift.none()):
        assert line(render(asked, thrift=thrift)).skipped == 0
        assert np.array_equal(render(asked, thrift=thrift).picture, render(scene, thrift=thrift).picture)
    with_patches = variants()["with constant_patches"]
    assert line(render(scene, thrift=with_patches)).skipped > 0


def test_a_shadow_is_not_smeared_over_a_block(small: str, written: Written) -> None:
    """Where a block sees a light in part, the light is not held: edges of shadows stay where they are."""
    scene = written(small)
    exact = Thrift.exact()
    budget = replace(exact, shading=replace(exact.shading, constant_patches=0.02))
    sharp, held = (render(scene, shadows=True, thrift=thrift).picture for thrift in (exact, budget))
    assert float(np.abs(sharp - held).max()) <= 0.02 + ROUNDING
