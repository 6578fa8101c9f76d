"""The truth itself, re-checked: exact values of random pairs and of every worst input, again at 50 digits.

The float64 truth (truth.py) is what all errors are measured against. Here ten thousand seeded pairs from the sweep's
own strata, and every stored worst input, are computed once more by the slow twin's bodies on numbers of 50 digits: the
balls of python-flint where it is installed, else mpmath, which takes some ten times as long. The largest disagreement,
relative for values above 1, goes into the manifest; one beyond the stated error (`angle_error`, `given_error`) is a
violation. Left out are inputs whose squared length float64 cannot hold, which only the hostile stratum has.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy import sweep as engine
from phongbench.accuracy.probes.exhaustive import COSINES
from phongbench.accuracy.probes.probe import Probing
from phongbench.formulas import exact as truth
from phongbench.inputs.pairs import HOSTILE_PAIRS, pairs
from phongbench.inputs.plan import Plan

#: random pairs, in so many draws from random contexts
RANDOM, DRAWS = 10_000, 100
DIGITS = 50
#: a disagreement is told in so many sentences at most
TOLD = 5
#: seconds a value takes with and without python-flint, for the forecast only; worst inputs are about five a cell
SECONDS = {True: 4e-5, False: 4e-4}
_PAIR = ["ax", "ay", "az", "bx", "by", "bz"]


@dataclass(frozen=True)
class Value:
    """An exact value as the float64 tier found it.

    pair  six floats, a then b
    kind  angle, given, or cosine: the angle that the product a.b names
    what  where it comes from, in words
    """

    pair: tuple[float, ...]
    alpha: float
    half: bool
    kind: str
    exact: float
    what: str


def measure(probing: Probing) -> Mapping[str, pd.DataFrame]:
    """No tables: facts for the manifest, and violations."""
    with_flint = find_spec("flint") is not None
    facts: dict[str, Any] = {"digits": DIGITS, "arithmetic": "python-flint" if with_flint else "mpmath"}
    for name, values in (("random", _random(probing)), ("worst", _stored(probing.worst))):
        checked, largest, share, told = 0, 0.0, 0.0, []
        with _digits(with_flint) as number:
            for value in values:
                if not _holds(value.pair):
                    continue
                off, stated = _disagreement(value, number)
                checked, share = checked + 1, max(share, off / stated)
                largest = max(largest, off / max(1.0, value.exact))
                if not off <= stated:
                    told.append(
                        f"{value.what}: the exact value {value.exact!r} is off by {off:.3g}, stated {stated:.3g}"
                    )
        facts |= {f"{name}_values": checked, f"{name}_disagreement": largest, f"{name}_share": share}
        probing.violations += told[:TOLD]
        if len(told) > TOLD:
            probing.violations.append(f"and {len(told) - TOLD} more {name} exact values are off by more than stated")
        probing.advance(0.5)
    probing.facts["recheck"] = facts
    return {}


def seconds(plan: Plan, jobs: int) -> float:
    """What the values take, on one core."""
    return SECONDS[find_spec("flint") is not None] * (RANDOM + 5 * sum(1 for _ in plan.cells()))


def _disagreement(value: Value, number: Callable[[float], Any]) -> tuple[float, float]:
    """How far the float64 value is off, and how far it may be."""
    u, v = [number(c) for c in value.pair[:3]], [number(c) for c in value.pair[3:]]
    if value.kind == "angle":
        again = truth.phong_of_angle(u, v, value.alpha, value.half)
        return _distance(again, value.exact), truth.angle_error(value.alpha, value.half)
    x = truth.product(u, v)
    if value.kind == "cosine":  # found from 1 - x, which float64 rounds
        again = truth.phong_of_cosine(x, value.alpha, value.half)
        return _distance(again, value.exact), truth.angle_error(value.alpha, value.half)
    again = truth.phong_of_cosine(x, value.alpha, value.half)
    cosine = float(2 * x * x - 1 if value.half and x > 0 else x)
    size = sum(abs(p * q) for p, q in zip(value.pair[:3], value.pair[3:], strict=True))
    stated = truth.given_error(float(again), cosine, size, value.alpha, value.half)
    return _distance(again, value.exact), stated


def _distance(again: Any, exact: float) -> float:
    return abs(float(again - exact))


def _holds(pair: tuple[float, ...]) -> bool:
    """True if float64 holds the squared lengths of both vectors with all their digits."""
    lengths = (sum(c * c for c in pair[:3]), sum(c * c for c in pair[3:]))
    return all(1e-290 < length < 1e300 for length in lengths)


def _random(probing: Probing) -> Iterator[Value]:
    """Pairs drawn from the sweep's contexts, with the truths that the sweep computes for them."""
    sweep, random = probing.sweep, np.random.default_rng([probing.plan.seed, DIGITS])
    contexts = [c for c in sweep.contexts if any(cell not in sweep.failures for cell in c.cells)]
    for _ in range(DRAWS if contexts else 0):
        context = contexts[random.integers(len(contexts))]
        alpha = sweep.cells[context.cells[random.integers(len(context.cells))]].setting.alpha
        last = HOSTILE_PAIRS if context.stratum.name == "hostile" else 1 << 40
        start, half = int(random.integers(last - RANDOM // DRAWS)), context.space == "half"
        a, b = pairs(
            context.stratum,
            context.precision,
            seed=probing.plan.seed,
            start=start,
            count=RANDOM // DRAWS,
            scale=context.scale,
            half_space=half,
        )
        exact = engine.exact_values(context, alpha, a, b)
        what = f"{context.stratum.name} pair in {context.precision.name}, alpha {alpha:g}"
        for row, kind in enumerate(truth.TRUTHS[: context.truths]):
            for i in np.flatnonzero(np.isfinite(exact[row])):
                pair = (*map(float, a[:, i]), *map(float, b[:, i]))
                yield Value(pair, alpha, half, kind, float(exact[row, i]), f"{what}, {kind}, number {start + i}")


def _stored(worst: pd.DataFrame) -> Iterator[Value]:
    """The stored worst inputs. Where the input is a cosine, the truth is that of the product a.b, which is exact."""
    names = ["alpha", "space", "truth", "exact", "stratum", "approximation", "precision", *_PAIR]
    for alpha, space, kind, exact, stratum, name, precision, *pair in zip(*(worst[n] for n in names), strict=True):
        seen = "cosine" if stratum == COSINES.name else kind
        what = f"worst {stratum} input of {name} in {precision}, alpha {alpha:g}, {seen}"
        yield Value(tuple(map(float.fromhex, pair)), float(alpha), space == "half", seen, float(exact), what)


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
