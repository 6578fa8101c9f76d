"""What subnormal numbers cost: Lyon's formula as a bare chain of squarings, beside ours, which cuts the chain off.

Squared six times, a y below 2^(-126/64) = 0.26 ends in numbers without a leading 1, which processors handle slowly,
and y below 2^(-149/64) = 0.20 has been through them. `elementary.squared` makes 0 of what would fall below 2^-120. Both
are timed on pairs near the peak, where nothing is subnormal, and on pairs over the whole lobe: the ratio on the one is
the price of the test, the ratio on the other what it saves.
"""

from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler import elementary
from phongbench.compiler.lowering import FLOAT32, Precision
from phongbench.compiler.precisions import Array
from phongbench.errors import MeasurementError
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.strata import HIGHLIGHT_REACH
from phongbench.results.machine import cache_sizes
from phongbench.timing import timed_kernels
from phongbench.timing.blocks import Block
from phongbench.timing.epoch_loop import tick
from phongbench.timing.interference import Witness
from phongbench.timing.rounds import run_rounds
from phongbench.timing.timed_kernels import TimedFormula, TimedKernel

ALPHA, GAMMA = 128.0, 64
#: what pairs are drawn over: shares of the lobe, from its peak
REACHES = {"near the peak": 0.25, "whole lobe": 1.0}
ROUNDS = 24


def chain(cosine_deficit: float, beta: float, n: int) -> float:
    """Lyon's highlight by squarings and nothing else: what `elementary.squared` is compared with."""
    result = elementary.positive_part(1.0 - beta * cosine_deficit)
    for _ in range(n):
        result = result * result
    return result


def kernels() -> list[TimedKernel]:
    """The bare chain and ours."""
    bare = {"lyon-chain": replace(REGISTRY["lyon"], name="lyon-chain", kernel=chain)}
    formulas = (
        TimedFormula.of(f"lyon-chain:dot:{GAMMA}", FLOAT32, ALPHA, registry=bare),
        TimedFormula.of(f"lyon:dot:{GAMMA}", FLOAT32, ALPHA),
    )
    return [timed_kernels.compiled(formula) for formula in formulas]


def inputs(reach: float, precision: Precision, seed: int, count: int) -> tuple[Array, Array]:
    """Pairs whose lambda is uniform from 0 to this share of the lobe, 1 / beta."""
    return timed_kernels.highlight_pairs(precision, seed, count, scale=reach * GAMMA / ALPHA / HIGHLIGHT_REACH)


def measure(rounds: int = ROUNDS, seed: int = 1) -> list[dict[str, Any]]:
    """Times in the first-level cache, interleaved: one row for each of REACHES.

    returns  pairs, subnormal (share of the bare chain's values that are), chain_ns, ours_ns (least per element), and
             the ratio chain / ours with its interval
    Raises MeasurementError if a kernel's values are not those of its plain formula.
    """
    rows, timed = [], kernels()
    for name, reach in REACHES.items():
        block = Block("l1", FLOAT32, list(timed), cache_sizes().l1 // 2, seed, partial(inputs, reach))
        try:
            rows.append(_row(name, block, rounds, seed))
        finally:
            block.close()
    return rows


def _row(name: str, block: Block, rounds: int, seed: int) -> dict[str, Any]:
    block.calibrate(tick())
    for problem in block.verify():
        raise problem
    block.nanoseconds(0, 1)  # the bare chain's values, to be counted
    values = np.abs(block.shares[0].out)
    with closing(Witness()) as witness:
        epoch, rng = partial(block.epoch, witness), np.random.default_rng(seed)
        readings = run_rounds(epoch, len(block.kernels), rounds, rng)
    if block.differs:
        raise MeasurementError(
            "a timed output differs from the verified one", name, "run again; if it stays, report it"
        )
    return {
        "pairs": name,
        "subnormal": float(((values > 0) & (values < FLOAT32.tiny)).mean()),
        "chain_ns": readings.least(0) / block.elements,
        "ours_ns": readings.least(1) / block.elements,
        **readings.ratio(0, 1).columns(),
        "rounds": readings.rounds(0),
    }
