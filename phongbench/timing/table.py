"""From readings to rows of timing.parquet: columns, ratios, verdicts, and rows of several processes merged."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from phongbench.results.schema import BASELINE, COPY, DOT, TIMING, TRIAD, TWIN
from phongbench.timing.rounds import Readings
from phongbench.timing.statistics import Interval, sign_interval, verdict
from phongbench.timing.timed_kernels import TimedKernel


def analyse(kernels: Sequence[TimedKernel], readings: Readings, elements: int) -> list[dict[str, Any]]:
    """One row for each kernel of a block: nanoseconds, ratios and verdict, from readings of a pass.

    elements  of a pass

    On several threads nanoseconds are of wall time for each element of all threads together: half of one thread's,
    at best, where there are two. The bandwidth is a fraction of what one thread copies or triads in the same rounds,
    whichever moves more: the least times of the two kernels may stem from moments when neighbours were unlike.
    """
    place = {kernel.name: i for i, kernel in reversed(list(enumerate(kernels))) if kernel.as_given}
    baseline, dot = place[BASELINE], place[DOT]
    ceiling = max((place[COPY], place[TRIAD]), key=lambda i: kernels[i].rows / readings.median(i))
    rows = []
    for i, kernel in enumerate(kernels):
        name, form, space, gamma, precision, recipe, normalise = kernel.key
        ratio = readings.ratio(i, baseline)
        rows.append(
            {
                "approximation": name,
                "lambda_form": form,
                "space": space,
                "beta_policy": "none",
                "gamma": gamma,
                "precision": precision,
                "recipe": recipe,
                "normalise": normalise,
                "threads": kernel.threads,
                "ns_min": readings.least(i) / elements,
                "ns_median": readings.median(i) / elements,
                **ratio.columns(),
                "verdict": verdict(ratio),
                "dot_ratio": readings.ratio(i, dot).middle,
                "bandwidth_fraction": kernel.rows / kernels[ceiling].rows / readings.ratio(i, ceiling).middle,
                "rounds": readings.rounds(i),
                "contaminated": int(readings.marked[i]),
                "compile_ms": kernel.compile_ms,
                "lit": math.nan,
                "processes": 1,
            }
        )
    return rows


def withheld(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows; if the twin was told apart from itself anywhere, no other row claims to be faster or slower."""
    if all(row["verdict"] == "unresolved" for row in rows if row["approximation"] == TWIN):
        return rows
    return [row if row["approximation"] == TWIN else {**row, "verdict": "unresolved"} for row in rows]


def merged(frames: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """One row per kernel from the tables of several processes, each with its own placement in memory.

    The ratio is the median of the processes' ratios. Its interval covers both what varies within a process and what
    varies between them: the sign-test interval across processes, from 8 of them on, widened to the median of the
    intervals within; with fewer processes it reaches from the lowest end to the highest. A row that is void in one
    process is left out.
    """
    everything = pd.concat(frames, ignore_index=True)
    rows = []
    for _, same in everything.groupby(TIMING.key, dropna=False, sort=False):
        if len(same) == len(frames):
            rows.append(_one(same))
    return TIMING.frame(withheld(rows))


def _one(same: pd.DataFrame) -> dict[str, Any]:
    logs = {name: np.log(same[name].to_numpy(np.float64)) for name in ("ratio", "ratio_low", "ratio_high")}
    middle, low, high = (float(np.median(log)) for log in logs.values())
    across = sign_interval(logs["ratio"])
    if math.isinf(across.low):
        across = Interval(middle, float(logs["ratio_low"].min()), float(logs["ratio_high"].max()))
    ratio = Interval(math.exp(middle), math.exp(min(low, across.low)), math.exp(max(high, across.high)))
    row: dict[str, Any] = {str(name): value for name, value in same.iloc[0].items()}
    row |= {name: float(same[name].median()) for name in ("ns_median", "dot_ratio", "bandwidth_fraction")}
    row |= {name: int(same[name].sum()) for name in ("rounds", "contaminated", "processes")}
    row |= {"ns_min": float(same["ns_min"].min()), "compile_ms": float(same["compile_ms"].max())}
    return row | ratio.columns() | {"verdict": verdict(ratio)}
