"""The truth itself, re-checked: exact values of random pairs and of every worst input, again at 50 digits.

All errors are measured against the float64 truth (formulas/exact.py). Here ten thousand seeded pairs of the sweep's
strata, and every stored worst input, are computed once more by the slow twin's bodies on numbers of 50 digits: the
balls of python-flint where it is installed, else mpmath, which takes some ten times as long. The largest disagreement,
relative for values above 1, goes into the manifest; one beyond the stated error (`angle_error`, `given_error`) is a
violation. Left out are inputs whose squared length float64 cannot hold, which only the hostile stratum has.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes.exhaustive import COSINES
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.accuracy.sweep import exact_values
from phongbench.formulas.exact import TRUTHS, angle_error, given_error, phong_of_angle, phong_of_cosine, product
from phongbench.formulas.formula import Formula
from phongbench.formulas.recipes import PAIR
from phongbench.inputs.pairs import HOSTILE_PAIRS
from phongbench.inputs.plan import Plan

#: random pairs, in so many draws from random batches
RANDOM, DRAWS = 10_000, 100
DIGITS = 50
#: so many disagreements are reported one by one
REPORTED = 5
#: seconds a value takes with and without python-flint, for the forecast only; worst inputs are about five a cell
SECONDS = {True: 3e-5, False: 4e-4}
_PAIR = ["ax", "ay", "az", "bx", "by", "bz"]


@dataclass(frozen=True)
class Value:
    """An exact value as float64 arithmetic gives it.

    pair  six floats, a then b
    kind  angle, given, or cosine: the angle that the product a.b names
    what  where it comes from, in words
    """

    pair: tuple[float, ...]
    alpha: float
    half: bool
    kind: str
    exact: float
    what: Callable[[], str]

    @property
    def key(self) -> tuple[Any, ...]:
        """What its disagreement depends on."""
        return self.pair, self.alpha, self.half, self.kind, self.exact


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """No tables: facts for the manifest, and violations."""
    with_flint = find_spec("flint") is not None
    facts: dict[str, Any] = {"digits": DIGITS, "arithmetic": "python-flint" if with_flint else "mpmath"}
    for name, values in (("random", _random(context)), ("worst", _stored(context.worst))):
        checked, largest, share, sentences = 0, 0.0, 0.0, []
        known: dict[Any, tuple[float, float]] = {}  # two of three worst inputs are those of several cells
        with _digits(with_flint) as number:
            for value in values:
                if not _holds(value.pair):
                    continue
                if value.key not in known:
                    known[value.key] = _disagreement(value, number)
                off, stated = known[value.key]
                checked, share = checked + 1, max(share, off / stated)
                largest = max(largest, off / max(1.0, value.exact))
                if not off <= stated:
                    sentences.append(
                        f"{value.what()}: the exact value {value.exact!r} is off by {off:.3g}, stated {stated:.3g}"
                    )
        facts |= {f"{name}_values": checked, f"{name}_disagreement": largest, f"{name}_share": share}
        context.violations += sentences[:REPORTED]
        if len(sentences) > REPORTED:
            context.violations.append(
                f"and {len(sentences) - REPORTED} more {name} exact values are off by more than stated"
            )
        context.advance(0.5)
    context.facts["recheck"] = facts
    return {}


def seconds(plan: Plan, jobs: int) -> float:
    """What the values take, on one core."""
    return SECONDS[find_spec("flint") is not None] * (RANDOM + 5 * sum(1 for _ in plan.cells()))


def _disagreement(value: Value, number: Callable[[float], Any]) -> tuple[float, float]:
    """How far the float64 value is off, and how far it may be."""
    u, v = [number(c) for c in value.pair[:3]], [number(c) for c in value.pair[3:]]
    if value.kind == "angle":
        again = phong_of_angle(u, v, value.alpha, value.half)
        return _distance(again, value.exact), angle_error(value.alpha, value.half)
    x = product(u, v)
    if value.kind == "cosine":  # made from 1 - x, which float64 rounds
        again = phong_of_cosine(x, value.alpha, value.half)
        return _distance(again, value.exact), angle_error(value.alpha, value.half)
    again = phong_of_cosine(x, value.alpha, value.half)
    cosine = float(2 * x * x - 1 if value.half and x > 0 else x)
    size = sum(abs(p * q) for p, q in zip(value.pair[:3], value.pair[3:], strict=True))
    stated = given_error(float(again), cosine, size, value.alpha, value.half)
    return _distance(again, value.exact), stated


def _distance(again: Any, exact: float) -> float:
    return abs(float(again - exact))


def _holds(pair: tuple[float, ...]) -> bool:
    """True if float64 holds the squared lengths of both vectors with all their digits."""
    lengths = (sum(c * c for c in pair[:3]), sum(c * c for c in pair[3:]))
    return all(1e-290 < length < 1e300 for length in lengths)


def _random(context: ProbeContext) -> Iterator[Value]:
    """Pairs drawn from the sweep's batches, with the truths that the sweep computes for them."""
    sweep, random = context.sweep, np.random.default_rng([context.plan.seed, DIGITS])
    pairs = [batch for batch in sweep.batches if batch.recipe == PAIR]
    batches = [batch for batch in pairs if any(cell not in sweep.failures for cell in batch.cells)]
    for _ in range(DRAWS if batches else 0):
        batch = batches[random.integers(len(batches))]
        alpha = sweep.cells[batch.cells[random.integers(len(batch.cells))]].alpha
        last = HOSTILE_PAIRS if batch.stratum.name == "hostile" else 1 << 40
        start, half = int(random.integers(last - RANDOM // DRAWS)), batch.space == "half"
        a, b = batch.pairs(context.plan.seed, start, RANDOM // DRAWS)
        exact = exact_values(batch, alpha, a, b)
        what = f"{batch.stratum.name} pair in {batch.precision.name}, alpha {alpha:g}, {{}}, number {{}}"
        for row, kind in enumerate(TRUTHS[: batch.truths]):
            for i in np.flatnonzero(np.isfinite(exact[row])):
                pair = (*map(float, a[:, i]), *map(float, b[:, i]))
                yield Value(pair, alpha, half, kind, float(exact[row, i]), partial(what.format, kind, start + i))


def _stored(worst: pd.DataFrame) -> Iterator[Value]:
    """The stored worst inputs. Where the input is a cosine, the truth is that of the product a.b, which is exact."""
    names = ["alpha", "space", "truth", "exact", "stratum", *_PAIR]
    rows = zip(*(worst[n].tolist() for n in names), strict=True)
    for position, (alpha, space, kind, exact, stratum, *pair) in enumerate(rows):
        seen = "cosine" if stratum == COSINES.name else kind
        what = partial(_described, worst, position, seen)
        yield Value(tuple(map(float.fromhex, pair)), float(alpha), space == "half", seen, float(exact), what)


def _described(worst: pd.DataFrame, position: int, seen: str) -> str:
    row: dict[str, Any] = {str(name): value for name, value in worst.iloc[position].items()}
    formula = Formula.of_row(row)
    return f"worst {row['stratum']} input of {formula} in {row['precision']}, alpha {row['alpha']:g}, {seen}"


@contextmanager
def _digits(with_flint: bool) -> Iterator[Callable[[float], Any]]:
    """While it lasts, numbers made by what it gives have DIGITS digits."""
    if with_flint:
        import flint

        with flint.ctx.workdps(DIGITS):
            yield flint.arb
    else:
        import mpmath

        with mpmath.workdps(DIGITS):
            yield mpmath.mpf
