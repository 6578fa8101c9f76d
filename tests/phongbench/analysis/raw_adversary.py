"""The search of `adversary` for raw vectors: N, L and V of lengths in the stated domain, and the steps before a pair.

Steps are written again here; formulas, forms and exact Phong are those of `adversary`.
"""

from dataclasses import replace

import numpy as np
from adversary import Array, Attack, Machine, exact

from phongbench.formulas.formula import Formula

#: lengths that are promised for
ANY = (1e-3, 1e3)


def mirrored(n: Array, light: Array) -> Array:
    """The true mirror direction."""
    n = n / np.linalg.norm(n, axis=0)
    return 2 * (n * light).sum(axis=0) * n - light


def configurations(rng: np.random.Generator, count: int, exponent: float) -> list[Array]:
    """N, L and V with V in the lobe around R, most of them near its peak, and L from all sides of the front."""
    n, light, side = (v / np.linalg.norm(v, axis=0) for v in rng.normal(size=(3, 3, count)))
    light *= np.where((n * light).sum(axis=0) < 0, -1.0, 1.0)
    r = mirrored(n, light)
    side -= (side * r).sum(axis=0) * r
    side /= np.linalg.norm(side, axis=0)
    deficit = np.minimum(rng.uniform(0, rng.choice([1.5, 4.0, 14.0]), count) / exponent, 1.0)
    near = count // 4
    deficit[:near] = 10.0 ** rng.uniform(-9, -2, near) / exponent
    return [n, light, (1 - deficit) * r + np.sqrt(deficit * (2 - deficit)) * side]


def pair_of(m: Machine, recipe: str, n: Array, light: Array, view: Array) -> tuple[Array, Array]:
    """R as the recipe makes it, and V; of the pair alone, R is given."""
    if recipe == "pair":
        return m.fit(mirrored(n, light)), view
    square = m.dot(n, n)
    if recipe == "reflect":
        n = m.mul(n, m.fit(1.0 / m.fit(np.sqrt(square))))
        square = np.ones_like(square)
    twice = m.mul(2.0, m.dot(n, light))
    return m.mad(twice, n, -m.mul(square, light)), view


def coordinate(m: Machine, formula: Formula, a: Array, b: Array) -> Array:
    """What the kernel is given, lengths removed."""
    form = formula.lambda_form
    if formula.normalise in ("none", "each"):
        if formula.normalise == "each":
            a, b = (m.mul(v, m.fit(1.0 / m.fit(np.sqrt(m.dot(v, v))))) for v in (a, b))
        return m.coordinate(form, a, b)
    squares = m.mul(m.dot(a, a), m.dot(b, b))
    if formula.normalise == "squared":
        x = m.dot(a, b)
        return m.fit(m.mul(x, x) / squares)
    if form == "cross":
        return m.fit(m.coordinate(form, a, b) / squares)
    x = m.fit(m.dot(a, b) / m.fit(np.sqrt(squares)))
    return x if form == "none" else m.fit(1.0 - x)


def worst(
    formula: Formula, alpha: float, precision: str, rng: np.random.Generator, lengths: tuple[float, float]
) -> float:
    """The largest error that is found: random configurations, then neighbours of the worst ones."""
    largest, count = 0.0, 1024
    for fused in (False,) if precision == "float64" else (False, True):
        machine = Machine(precision, fused)
        attack = Attack(replace(formula, recipe="pair"), alpha, machine)
        vectors = configurations(rng, count, attack.exponent)
        sizes = list(np.exp(rng.uniform(*np.log(lengths), (3, count))))
        for turn in range(5):
            made = (v / np.linalg.norm(v, axis=0) * size for v, size in zip(vectors, sizes, strict=True))
            n, light, view = (machine.fit(v) for v in made)
            a, b = pair_of(machine, formula.recipe, n, light, view)
            value = attack.kernel(machine, coordinate(machine, formula, a, b), **attack.values)
            true = exact(a if formula.recipe == "pair" else mirrored(n, light), view, alpha, "reflect")
            errors = np.abs(np.where(machine.dot(a, b) > 0, value, 0.0) - true)
            largest = max(largest, float(errors.max()))
            chosen = np.repeat(np.argsort(errors)[-32:], count // 32)
            scale = 2.0 ** -rng.integers(9, 26, count) if turn % 2 else 2.0**-23
            sizes = [size[chosen] for size in sizes]
            vectors = [v[:, chosen] * (1 + rng.integers(-4, 5, (3, count)) * scale) for v in vectors]
    return largest
