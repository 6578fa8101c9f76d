"""What shading and pictures ask at least: counted by numbers that count their multiplications, and by laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from phongbench.benchmarks import rooflines
from phongbench.benchmarks.bounds import BYTES, PORTS, ROOTS, VECTORS
from phongbench.benchmarks.rooflines import Asked
from phongbench.scenes.render import render
from phongbench.scenes.scene_files import read_scene
from phongbench.scenes.skips import SceneSkips


class Counting:
    """A number that counts how often numbers like it are multiplied."""

    multiplied: ClassVar[int] = 0

    def __add__(self, other: Counting) -> Counting:
        return self

    __sub__ = __add__

    def __mul__(self, other: Counting) -> Counting:
        Counting.multiplied += 1
        return self


Vector = Sequence[Counting]


def dot(a: Vector, b: Vector) -> Counting:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def scaled(a: Vector, factor: Counting) -> Vector:
    return [component * factor for component in a]


def plus(a: Vector, b: Vector) -> Vector:
    return [one + other for one, other in zip(a, b, strict=True)]


def unit(a: Vector) -> Vector:
    dot(a, a)
    return scaled(a, Counting())  # the root and its quotient are no multiplications


def test_steps_multiply_as_often_as_they_are_counted() -> None:
    x = Counting()
    a, b = [x, x, x], [x, x, x]
    steps = {
        "UNIT": lambda: unit(a),
        "DOT": lambda: dot(a, b),
        "REFLECTED": lambda: plus(scaled(a, x + x), b),
        "COLOURED": lambda: plus(a, scaled(b, x)),
        "SPHERE": lambda: dot(plus(a, scaled(b, dot(a, b))), a),
        "PLANE": lambda: (dot(a, b), dot(a, b)),
        "FOUND": lambda: (plus(a, scaled(b, x)), scaled(plus(a, b), x)),
    }
    for name, step in steps.items():
        Counting.multiplied = 0
        step()
        assert Counting.multiplied == getattr(rooflines, name).multiply_adds, name


def shaded(skipped: dict[str, int], *, placed: bool = False) -> Asked:
    return rooflines.of_pairs(100, {"pairs": 800, **skipped}, 20.0, unit=rooflines.UNIT * 2, placed=placed)


def test_a_pair_that_is_left_out_asks_nothing() -> None:
    whole, none = shaded({}), shaded({"lights_behind": 300, "out_of_reach": 500})
    assert none == rooflines.UNIT * 200
    dark = shaded({"dark_tail": 800})
    assert none.multiply_adds < dark.multiply_adds < whole.multiply_adds
    assert dark + (rooflines.REFLECTED + Asked(20.0) + rooflines.COLOURED) * 800 == whole
    assert whole + rooflines.UNIT * 800 == shaded({}, placed=True)


def test_the_scarcer_of_multiply_adds_and_bytes_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("phongbench.benchmarks.bounds.lanes", lambda: 16)
    ceilings = {
        "l2": {PORTS: 2.0, VECTORS: 2.0, BYTES: 100.0, ROOTS: 4.0},
        "memory": {PORTS: 1.0, VECTORS: 1.0, BYTES: 10.0, ROOTS: 1.0},
    }
    computing = rooflines.columns(Asked(32e9, 1e9, 1e9), 4.0, ceilings)
    assert (computing["bound"], computing["over_bound"], computing["bound_by"]) == (1.0, 4.0, PORTS)
    moving = rooflines.columns(Asked(32e9, 1e9, 20e9), 2.0, ceilings)
    assert (moving["bound"], moving["over_bound"], moving["bound_by"]) == (2.0, 1.0, BYTES)
    rooting = rooflines.columns(Asked(32e9, 16e9, 20e9), 4.0, ceilings)
    assert (rooting["bound"], rooting["over_bound"], rooting["bound_by"]) == (4.0, 1.0, ROOTS)


@pytest.mark.parametrize("ceilings", [{}, {"l2": {}, "memory": {}}, {"l2": {PORTS: 1.0}}])
def test_without_ceilings_there_is_no_roofline(ceilings: dict[str, dict[str, float]]) -> None:
    told = rooflines.columns(Asked(1.0, 1.0, 1.0), 1.0, ceilings)
    assert (told["bound"], told["over_bound"], told["bound_by"]) == (None, None, None)
    assert rooflines.excuse({"name": "x", **told}) is None


def test_only_what_is_far_above_its_roofline_is_explained() -> None:
    row = {"name": "shade", "over_bound": 1.3}
    assert rooflines.excuse(row) is None
    assert "2 times its roofline" in str(rooflines.excuse(row | {"over_bound": 2.0}))


def test_a_picture_asks_for_what_was_not_left_out() -> None:
    scene = read_scene("test-card")
    scene = replace(scene, picture=replace(scene.picture, size=(32, 18), depth=1))
    all_of_it, less = (render(scene, skips=skips, threads=1) for skips in (SceneSkips.none(), SceneSkips()))
    assert np.abs(all_of_it.picture - less.picture).max() < 0.01
    much, little = (rooflines.of_picture(scene, done) for done in (all_of_it, less))
    assert much.bytes == little.bytes == 32 * 18 * rooflines.VECTOR
    assert 0 < little.multiply_adds < much.multiply_adds
    assert 0 < little.roots < much.roots
