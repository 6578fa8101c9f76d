"""Ears are cut as the plain algorithm cuts them, without its work."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from phongbench.inputs import ears

FLAT = 1e-15


def plain(x: list[float], y: list[float], flat: float) -> list[tuple[int, int, int]] | None:
    """The same by definition: each corner in turn, against every other one."""
    ring, found, at, tried, straight = list(range(len(x))), [], 0, 0, False

    def turn(a: int, b: int, c: int) -> float:
        return (x[b] - x[a]) * (y[c] - y[b]) - (y[b] - y[a]) * (x[c] - x[b])

    def around(i: int) -> tuple[int, int, int]:
        return ring[i - 1], ring[i], ring[(i + 1) % len(ring)]

    def held(a: int, b: int, c: int, p: int) -> bool:
        corner = any((x[p], y[p]) == (x[q], y[q]) for q in (a, b, c))
        return not corner and min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) >= -flat

    while len(ring) > 3:
        a, b, c = around(at)
        blunt = [ring[i] for i in range(len(ring)) if turn(*around(i)) <= flat]
        ear = b not in blunt and not any(held(a, b, c, p) for p in blunt)
        if ear or (straight and abs(turn(a, b, c)) <= flat):
            found.append((a, b, c))
            del ring[at]
            at, tried, straight = at % len(ring), 0, False
            continue
        at, tried = (at + 1) % len(ring), tried + 1
        if tried > len(ring):
            if straight:
                return None
            tried, straight = 0, True
    a, b, c = around(at)
    return [*found, (a, b, c)] if turn(a, b, c) >= -flat else None


def spiral(corners: int, turns: float, least: float = 0.05) -> np.ndarray:
    """A band that winds inwards; the smaller `least`, the more of it lies near the middle."""
    t = np.linspace(0, 1, corners // 2)
    radius = least**t
    width = least ** (1 / turns)
    arm = np.column_stack([np.cos(2 * np.pi * turns * t), np.sin(2 * np.pi * turns * t)])
    outer, inner = radius[:, None] * arm, (0.5 * (1 + width) * radius)[:, None] * arm
    return np.concatenate([outer, inner[::-1]])


def strip(corners: int) -> np.ndarray:
    """Corners on two straight lines."""
    x = np.arange(corners // 2, dtype=float)
    return np.concatenate([np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x + 1])])


def comb(corners: int) -> np.ndarray:
    x = np.arange(corners - 2, dtype=float)[::-1]
    return np.concatenate([[(0, 0), (len(x), 0)], np.column_stack([x, 1 + 2 * (x % 2)])])


def shape(kind: str, rng: np.random.Generator) -> np.ndarray:
    """A random polygon: whole, with corners on straight lines and touching edges, or crossing itself."""
    corners = int(rng.integers(4, 60))
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    star = rng.uniform(0.1, 1, corners)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if kind == "star":
        return star
    if kind == "star on a grid":
        return np.round(4 * star) / 4
    if kind == "spiral on a grid":
        return np.round(20 * spiral(2 * corners, rng.uniform(1, 3))) / 20
    if kind == "comb":
        points = comb(corners)
        points[2:, 1] = rng.integers(0, 4, len(points) - 2)
        return points
    return rng.integers(0, 4, (corners, 2)).astype(float)


@pytest.mark.parametrize("kind", ["star", "star on a grid", "spiral on a grid", "comb", "garbage"])
def test_the_triangles_are_those_of_the_plain_algorithm_in_its_order(kind: str) -> None:
    rng = np.random.default_rng(7)
    results = []
    for _ in range(40):
        x, y = shape(kind, rng).T.tolist()
        results.append(ears.cut(x, y, 16 * FLAT))
        assert results[-1] == plain(x, y, 16 * FLAT)
    assert any(results) or kind == "garbage"
    assert None in results or kind in ("star", "comb")


SHAPES = {
    "spiral": lambda n: spiral(n, 20),
    "spiral into a point": lambda n: spiral(n, 20, 1e-6),
    "strip": strip,
    "comb": comb,
}


@pytest.mark.parametrize("name", SHAPES)
def test_the_work_grows_little_faster_than_the_corners(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted in corners that are tested against a triangle: the plain algorithm tests millions of them."""
    tested = [0]
    near = ears._Tree.near

    def counted(tree: ears._Tree, *triangle: Any) -> Iterable[int]:
        for corner in near(tree, *triangle):
            tested[0] += 1
            yield corner

    monkeypatch.setattr(ears._Tree, "near", counted)
    each = []
    for corners in (500, 2000):
        x, y = SHAPES[name](corners).T.tolist()
        tested[0] = 0
        found = ears.cut(x, y, FLAT * max(max(x) - min(x), max(y) - min(y)) ** 2)
        assert found is not None
        assert len(found) == len(x) - 2
        each.append(tested[0] / len(x))
    assert each[-1] < 60
    assert each[-1] < 2.6 * each[0]  # of four times as many corners; by the plain algorithm it would be four times
