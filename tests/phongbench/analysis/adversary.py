"""A search for pairs of vectors on which a formula errs more than was promised, by code of its own.

Nothing here is the product's but the coefficients of a formula: the arithmetic of each precision, with products rounded
or fused, how vectors are normalised, lambda forms, formulas and exact Phong are written again, in NumPy, on float64
arrays that hold the numbers of the precision.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.formulas.formula import Formula

Array = NDArray[np.float64]
#: raw vectors a shader is given have lengths in this range
RAW = (0.25, 4.0)


@dataclass(frozen=True)
class Machine:
    """A unit that computes in a precision; fused: products are rounded together with the sum that they go into."""

    precision: str
    fused: bool

    def fit(self, x: Array) -> Array:
        """The nearest number of the precision, ties to even."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            if self.precision in ("float16", "float32", "float64"):
                return np.asarray(x, np.float64).astype(self.precision).astype(np.float64)
            if self.precision == "bfloat16":
                mantissa, exponent = np.frexp(x)
                return np.ldexp(np.rint(np.ldexp(mantissa, 8)), exponent - 8)
            whole, fraction = (int(part) for part in self.precision[1:].split("."))
            step = 2.0**-fraction
            return np.clip(np.rint(np.asarray(x) / step) * step, -(2.0**whole), 2.0**whole - step)

    def mad(self, a: Any, b: Any, c: Any) -> Array:
        """a b + c."""
        return self.fit(a * b + c) if self.fused else self.fit(self.fit(a * b) + c)

    def mul(self, a: Any, b: Any) -> Array:
        """A product."""
        return self.fit(a * b)

    def dot(self, a: Array, b: Array) -> Array:
        """a.b of rows (3, n)."""
        return self.mad(a[2], b[2], self.mad(a[1], b[1], self.mul(a[0], b[0])))

    def constant(self, value: float) -> float:
        """A coefficient; fixed point keeps as many significant bits as it has."""
        if self.precision[0] != "q":
            return float(self.fit(np.array(value)))
        digits = sum(int(part) for part in self.precision[1:].split("."))
        mantissa, exponent = np.frexp(value)
        return float(np.ldexp(np.rint(np.ldexp(mantissa, digits)), exponent - digits))

    def unit(self, v: Array, way: str) -> Array:
        """Vectors (3, n) made unit as a shader does it, or rounded from truly unit ones."""
        if way == "rounded" or self.precision[0] == "q":
            return self.fit(v / np.linalg.norm(v, axis=0))
        held = self.fit(v)
        root = self.fit(np.sqrt(self.dot(held, held)))
        return self.fit(held / root) if way == "quotient" else self.mul(held, self.fit(1.0 / root))

    def coordinate(self, form: str, a: Array, b: Array) -> Array:
        """What the kernel is given."""
        if form in ("dot", "none"):
            x = self.dot(a, b)
            return x if form == "none" else self.fit(1.0 - x)
        if form == "difference":
            d = self.fit(a - b)
            return self.mul(0.5, self.dot(d, d))
        c = np.stack([self.mad(a[i], b[j], -self.mul(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1))])
        half = self.mul(0.5, self.dot(c, c))
        if form == "cross":
            return half
        x = self.dot(a, b)
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.fit(half / self.mul(x, x))


WAYS = ("reciprocal", "quotient", "rounded")


def _squarings(m: Machine, y: Array, n: int) -> Array:
    y = np.maximum(y, 0.0)
    for _ in range(n):
        y = m.mul(y, y)
    return y


def _lyon(m: Machine, x: Array, beta: float, n: int) -> Array:
    return _squarings(m, m.mad(-beta, x, 1.0), n)


def _quadratic(m: Machine, x: Array, beta: float, curvature: float, turn: float, n: int) -> Array:
    v = np.minimum(m.mul(beta, x), turn)
    return _squarings(m, m.mad(-v, m.mad(-curvature, v, 1.0), 1.0), n)


def _gaussian(m: Machine, x: Array, sharpness: float) -> Array:
    return m.fit(np.exp(m.mul(-sharpness, x)))


def _power(m: Machine, x: Array, exponent: float) -> Array:
    return m.fit(np.maximum(x, 0.0) ** exponent)


def _phong(m: Machine, x: Array, alpha: float) -> Array:
    return _power(m, x, alpha)


def _whole(m: Machine, x: Array, exponent: int) -> Array:
    x = np.maximum(x, 0.0)
    result = x
    for bit in bin(exponent)[3:]:
        result = m.mul(result, result)
        if bit == "1":
            result = m.mul(result, x)
    return result


def _schlick(m: Machine, x: Array, alpha: float) -> Array:
    x = np.maximum(x, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return m.fit(x / m.fit(m.mad(-alpha, x, alpha) + x))


def _table(m: Machine, position: Array, table: Array) -> Array:
    position = np.clip(position, 0.0, len(table) - 1.0)
    i = np.minimum(position.astype(int), len(table) - 2)
    return m.mad(m.fit(position - i), m.fit(table[i + 1] - table[i]), table[i])


def _table_u(m: Machine, x: Array, scale: float, bend: float, table: Array) -> Array:
    return _table(m, m.mul(x, m.mad(bend, x, scale)), table)


def _table_x(m: Machine, x: Array, table: Array) -> Array:
    return _table(m, m.mul(len(table) - 1.0, x), table)


def _kuijk_blake(m: Machine, x: Array, inner: float, outer: float, top: float, skirt: float) -> Array:
    angle = m.fit(np.arccos(np.clip(x, -1.0, 1.0)))
    rest = np.maximum(m.fit(outer - angle), 0.0)
    near, far = m.mad(-top, m.mul(angle, angle), 1.0), m.mul(skirt, m.mul(rest, rest))
    return np.where(angle < inner, near, far)


def _bit_trick(m: Machine, x: Array, alpha: float) -> Array:
    mantissa, exponent = np.frexp(np.maximum(x, 1e-37))
    t = m.fit(m.mul(alpha, m.fit(exponent - 1 + (2 * mantissa - 1))) - 60801 / 2**20)
    k = np.floor(np.maximum(t, -200.0))
    return m.fit(np.where(x > 0, 2.0**k * (1 + np.maximum(t, -200.0) - k), 0.0))


def _parabola(m: Machine, x: Array, octaves: float) -> Array:
    constant, slope, curvature = (m.constant(v) for v in (1.0017247597, 0.6576359377, 0.3371894346))
    t = np.maximum(m.mul(-octaves, np.maximum(x, 0.0)), -120.0)
    k = np.trunc(t) - 1
    f = m.fit(t - k)
    value = m.mul(m.mad(f, m.mad(f, curvature, slope), constant), 2.0**k)
    return np.where(t > -120.0, value, 0.0)


def _doom3(m: Machine, x: Array) -> Array:
    return _squarings(m, m.mad(-4.0, x, 1.0), 1)


#: by name, the formulas written again: (machine, coordinate, coefficients by name)
FORMULAS: dict[str, Callable[..., Array]] = {
    "lyon": _lyon,
    "lyon-quadratic": _quadratic,
    "gaussian": _gaussian,
    "phong": _phong,
    "blinn": _power,
    "integer-power": _whole,
    "schlick": _schlick,
    "table-u": _table_u,
    "table-x": _table_x,
    "kuijk-blake": _kuijk_blake,
    "bit-trick": _bit_trick,
    "gaussian-quadratic": _parabola,
    "doom3": _doom3,
}


def exact(a: Array, b: Array, alpha: float, space: str) -> Array:
    """Phong of the true angle between the vectors, or of twice that angle."""
    a, b = (v / np.linalg.norm(v, axis=0) for v in (a, b))
    deficit = 0.5 * ((a - b) ** 2).sum(axis=0)
    if space == "half":
        deficit = np.where(deficit < 1, 2 * deficit * (2 - deficit), 2.0)
    with np.errstate(divide="ignore"):
        return np.exp(alpha * np.log1p(-np.minimum(deficit, 1.0)))


class Attack:
    """A formula at one exponent on one machine."""

    def __init__(self, formula: Formula, alpha: float, machine: Machine) -> None:
        self.alpha, self.form, self.space, self.machine = alpha, formula.lambda_form, formula.space, machine
        spec, setting = formula.spec(), formula.setting(alpha)
        self.values = {
            k: v if isinstance(v, int) else machine.constant(v) for k, v in spec.coefficients(setting).items()
        }
        if spec.table is not None:
            self.values["table"] = machine.fit(spec.table(setting))
        self.kernel, self.exponent = FORMULAS[formula.approximation], setting.exponent

    def errors(self, a: Array, b: Array) -> Array:
        """|value - exact| on vectors that the precision holds."""
        value = self.kernel(self.machine, self.machine.coordinate(self.form, a, b), **self.values)
        lit = self.machine.dot(a, b) > 0
        return np.abs(np.where(lit, value, 0.0) - exact(a, b, self.alpha, self.space))


def raw_pairs(rng: np.random.Generator, count: int, exponent: float, share: tuple[float, float]) -> tuple[Array, Array]:
    """Raw pairs, most of them in the lobe; a quarter so near its peak that rounding decides, a tenth at the horizon."""
    a = rng.normal(size=(3, count))
    side = np.cross(a, rng.normal(size=(3, count)), axis=0)
    a, side = a / np.linalg.norm(a, axis=0), side / np.linalg.norm(side, axis=0)
    deficit = np.minimum(rng.uniform(0, rng.choice([1.5, 4.0, 14.0]), count) / exponent, 1.0)
    near, far = count // 4, count // 10
    deficit[:near] = 10.0 ** rng.uniform(-9, -2, near) / exponent
    deficit[near : near + far] = 1 + rng.normal(size=far) * 10.0 ** rng.uniform(-8, -1, far)
    cosine = 1 - deficit
    b = cosine * a + np.sqrt(np.maximum(0.0, 1 - cosine**2)) * side
    low, high = np.log(share)
    lengths = np.exp(rng.uniform(low, high, (2, count)))
    return lengths[0] * a, lengths[1] * b


def worst(
    formula: Formula,
    alpha: float,
    precision: str,
    rng: np.random.Generator,
    *,
    length_error: float = 0.0,
    pairs: int = 2048,
    rounds: int = 5,
) -> float:
    """The largest error that is found: for each way to normalise, random pairs, then neighbours of the worst ones."""
    largest = 0.0
    for fused in (False,) if precision == "float64" else (False, True):
        machine = Machine(precision, fused)
        attack = Attack(formula, alpha, machine)
        for way in WAYS:
            largest = max(largest, _climb(attack, machine, way, rng, length_error, pairs, rounds))
    return largest


def _climb(
    attack: Attack, machine: Machine, way: str, rng: np.random.Generator, length_error: float, pairs: int, rounds: int
) -> float:
    a, b = raw_pairs(rng, pairs, attack.exponent, RAW)
    signs = rng.choice([-1.0, 1.0, 1.0, -1.0, 0.0], (2, pairs)) * length_error
    largest, best = 0.0, max(1, pairs // 32)
    for turn in range(rounds):
        ua, ub = (machine.unit(v, way) for v in (a, b))
        if length_error:
            ua, ub = (machine.fit(u * (1 + s)) for u, s in zip((ua, ub), signs, strict=True))
        errors = attack.errors(ua, ub)
        errors = np.where(np.isfinite(errors), errors, np.inf)
        largest = max(largest, float(errors.max()))
        chosen = np.repeat(np.argsort(errors)[-best:], pairs // best)
        count, scale = len(chosen), 2.0 ** -rng.integers(9, 26, len(chosen)) if turn % 2 else 2.0**-23
        moves = rng.integers(-4, 5, (2, 3, count)) * scale
        a, b = (v[:, chosen] * (1 + move) for v, move in zip((a, b), moves, strict=True))
        signs, pairs = signs[:, chosen], count
    return largest
