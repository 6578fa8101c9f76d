"""What devices err by that err as much as they may: a short search with the code that is emitted for them."""

from collections.abc import Callable

import numpy as np
from emulated_devices import Floats, Machine, Vector

from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.evaluated import highlight

Direction = Callable[[Floats], Floats]


def directions(rng: np.random.Generator) -> dict[str, Direction]:
    """Ways to err: always up, always down, by operation, by number; beyond 0.5 subnormal results are flushed."""
    return {
        "up": lambda exact: np.full(np.shape(exact), 0.4),
        "down": lambda exact: np.full(np.shape(exact), -0.4),
        "by operation": lambda exact: np.full(np.shape(exact), rng.uniform(-1, 1)),
        "by number": lambda exact: rng.uniform(-1, 1, np.shape(exact)),
    }


def exact(formula: Formula, alpha: float, given: list[Floats]) -> Floats:
    """Exact Phong of the directions of these vectors; of the half way direction that of twice its angle to N."""
    unit = [v / np.linalg.norm(v, axis=0) for v in given]
    if formula.recipe == "pair":
        a, b = unit
    elif formula.recipe == "halfway":
        a, b = unit[0], (unit[1] + unit[2]) / np.linalg.norm(unit[1] + unit[2], axis=0)
    else:
        n, light, b = unit
        a = 2 * (n * light).sum(axis=0) * n - light
    deficit = 0.5 * ((a - b) ** 2).sum(axis=0)
    if formula.space == "half":
        deficit = 2 * deficit * (2 - deficit)
    return np.exp(alpha * np.log1p(-np.minimum(deficit, 1 - 1e-16)))


def vectors(
    rng: np.random.Generator, machine: Machine, formula: Formula, exponent: float, count: int, most: float = 1.2
) -> list[Vector]:
    """What code takes, of lengths from 0.3 to 3: pairs whose angles fill the lobe, a tenth nearly equal, or N, L and V
    that make such pairs, at incidences up to 79 degrees; `most` is the largest deficit.
    """
    u, w = rng.normal(size=(2, 3, count))
    u /= np.linalg.norm(u, axis=0)
    w -= (w * u).sum(axis=0) * u
    w /= np.linalg.norm(w, axis=0)
    deficit = np.minimum(rng.uniform(0, 6, count) / exponent, most) * rng.choice([0.0, 1e-6, *[1.0] * 18], count)
    v = (1 - deficit) * u + np.sqrt(deficit * (2 - deficit)) * w
    made = _from_n_l_v(rng, formula, u, w, v) if formula.recipe != "pair" else [u, v]
    held = (machine.constant(x * rng.uniform(0.3, 3.0, count)) for x in made)
    return [Vector(*map(machine.number, parts)) for parts in held]


def _from_n_l_v(rng: np.random.Generator, formula: Formula, u: Floats, w: Floats, v: Floats) -> list[Floats]:
    """N, L and V of which a recipe makes u and v, which span a plane with w, normal to u."""
    turn = np.radians(rng.uniform(0, 79, u.shape[1]))
    if formula.recipe == "halfway":
        across = np.cross(np.cross(u, w, axis=0), v, axis=0)
        return [u, np.cos(turn) * v + np.sin(turn) * across, np.cos(turn) * v - np.sin(turn) * across]
    side = rng.normal(size=u.shape)
    side -= (side * u).sum(axis=0) * u
    n = np.cos(turn) * u + np.sin(turn) * side / np.linalg.norm(side, axis=0)
    return [n, 2 * (n * u).sum(axis=0) * n - u, v]


def worst_found(
    formula: Formula,
    alpha: float,
    precision: str,
    rng: np.random.Generator,
    *,
    limited: bool,
    count: int = 1024,
    most: float = 1.2,
) -> float:
    """The largest error of devices that were tried."""
    spec, setting, found = formula.spec(), formula.setting(alpha), 0.0
    for way in directions(rng).values():
        machine = Machine(precision, way)
        given = vectors(rng, machine, formula, setting.exponent, count, most)
        if formula.normalise == "none":
            given = [v * machine.inversesqrt(v.dot(v)) for v in given]
        code = highlight(spec, formula, setting, machine.words(), limited=limited)
        with np.errstate(over="ignore", invalid="ignore"):
            errors = np.abs(code(*given).values - exact(formula, alpha, [v.values() for v in given]))
        found = max(found, float(np.nanmax(errors)))
    return found
