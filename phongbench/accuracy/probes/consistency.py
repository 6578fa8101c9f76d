"""What rows of different coverage owe to one another: sampled <= searched <= exhaustive <= certified <= contract.

Checked on the rows of every run, wherever two are comparable. A violation is a bug, in the measuring or in the proof,
and makes the run end with exit code 3.

1. Same cell, same inputs: a maximum of samples is at most that of a search, and that at most the one over all inputs.
2. Nearly unit vectors: what the search found is at least what any stratum of unit vectors found by sampling.
3. A certified bound is at least every model_max, whatever the inputs: that part is the formula on unit directions.
4. An error is at most its parts: max_abs <= certified + length_max + rounding_max, over all cosines too.
5. A bound by contract is at least what was measured in its precision on nearly unit vectors, and at least the certified
   one of the formula alone, but for what makes the latter tight: devices may err, and need not. The same of what its
   written code errs by where every operation is rounded to nearest (`of_written_code`).

Measured numbers are those of float64 arithmetic, which errs by at most `slack`: half a dozen roundings of lambda, each
raised alpha times by the slope of the highlight, and the power itself; and by `OF_SUMS`, for formats that overshoot.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from phongbench.formulas.formula import Formula
from phongbench.results.frames import as_given, compacted
from phongbench.results.schema import CASE, COVERAGES, EXACT

#: strata of unit vectors: samples of the domain that the search covers
UNIT_STRATA = ("uniform", "highlight", "peak", "cutoff", "grazing")
#: the stratum of searched rows: all pairs of nearly unit vectors
VECTORS = "vectors"
#: the stratum of rows by contract: all pairs that a conforming device made unit
DEVICES = "devices"
#: how much above an error that occurs a certified bound may be, as a share and absolutely
TIGHT = 1.002, 1e-9
#: how much larger than its parts a float64 sum of three differences may be, as a share
OF_SUMS = 2.0**-50
#: maxima that only grow when more inputs are looked at
MAXIMA = ("max_abs", "max_above", "max_below", "model_max", "rounding_max", "above_one", "negative")
#: sentences reported; a bug that shows everywhere needs no more
REPORTED = 20

_CELL = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"]


def violations(accuracy: pd.DataFrame) -> list[str]:
    """Sentences on rows of accuracy that contradict each other; empty if all is well."""
    if accuracy.empty:
        return []
    accuracy = compacted(accuracy)
    contradictions = list(_by_coverage(accuracy)) + list(_searched(accuracy)) + list(_certified(accuracy))
    contradictions += _by_contract(accuracy)
    more = len(contradictions) - REPORTED
    return contradictions[:REPORTED] + ([f"and {more} more contradictions of coverage"] if more > 0 else [])


def of_written_code(emitted: pd.DataFrame, accuracy: pd.DataFrame) -> list[str]:
    """Sentences on written code that errs beyond its bound by contract, which holds with every rounding."""
    bounds = accuracy[accuracy["coverage"] == "contract"]
    code = emitted[emitted["code"] == "gpu"].assign(gated=True)
    return list(_larger(code, bounds, [*_CELL, "precision"], ("max_abs",), "written code's", "contract"))


def slack(alpha: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """How far float64 arithmetic may be off in a measured maximum."""
    return 1e-12 + 2.0**-48 * alpha


def _by_coverage(accuracy: pd.DataFrame) -> Iterator[str]:
    """Rule 1."""
    seen = accuracy.groupby("stratum")["coverage"].nunique()
    several = accuracy[accuracy["stratum"].isin(seen.index[seen > 1])]  # few strata: comparing all rows takes long
    several = several[several["precision"] != EXACT]
    several = several[several.duplicated(CASE, keep=False)]
    for weak, strong in pairwise(COVERAGES[:3]):
        first, second = (several[several["coverage"] == name] for name in (weak, strong))
        yield from _larger(first, second, CASE, MAXIMA if strong != "searched" else MAXIMA[:1], weak, strong)
    first, second = (several[several["coverage"] == name] for name in ("sampled", "exhaustive"))
    yield from _larger(first, second, CASE, MAXIMA, "sampled", "exhaustive")


def _searched(accuracy: pd.DataFrame) -> Iterator[str]:
    """Rule 2."""
    key = [*_CELL, "precision", "gated"]
    searched = as_given(accuracy[(accuracy["stratum"] == VECTORS) & (accuracy["coverage"] == "searched")])
    unit = accuracy["alpha"].isin(searched["alpha"]) & accuracy["stratum"].isin(UNIT_STRATA)
    sampled = accuracy[unit & (accuracy["coverage"] == "sampled") & (accuracy["truth"] == "angle")]
    yield from _larger(as_given(sampled[sampled["nonfinite"] == 0]), searched, key, ("max_abs",), "sampled", "searched")


def _certified(accuracy: pd.DataFrame) -> Iterator[str]:
    """Rules 3 and 4."""
    bounds = accuracy[accuracy["coverage"] == "certified"]
    if bounds.empty:
        return
    of_angle = ~accuracy["stratum"].isin(["configurations", "hostile"])  # the former are no function of it alone
    known = accuracy["alpha"].isin(bounds["alpha"]) & ~accuracy["coverage"].isin(["certified", "contract"])
    measured = accuracy[known & of_angle & (accuracy["truth"] == "angle") & accuracy["gated"].astype(bool)]
    both = measured.merge(bounds[[*_CELL, "model_max"]], on=_CELL, suffixes=("", "_bound"))
    limit = both["model_max_bound"] + slack(both["alpha"].to_numpy(float))
    for row in both[both["model_max"] > limit].to_dict("records"):
        yield f"{_named(row)}: model_max {row['model_max']:.17g} is above its bound {row['model_max_bound']:.17g}"
    whole = (limit + both["length_max"].fillna(0.0) + both["rounding_max"]) * (1.0 + OF_SUMS)
    for row in both[(both["max_abs"] > whole) & (both["nonfinite"] == 0)].to_dict("records"):
        yield f"{_named(row)}: max_abs {row['max_abs']:.17g} is above the sum of its bounded parts"


def _by_contract(accuracy: pd.DataFrame) -> Iterator[str]:
    """Rule 5."""
    bounds = accuracy[accuracy["coverage"] == "contract"]
    if bounds.empty:
        return
    unit = accuracy["stratum"].isin([*UNIT_STRATA, VECTORS]) & accuracy["gated"].astype(bool)
    measured = accuracy[unit & (accuracy["truth"] == "angle") & (accuracy["nonfinite"] == 0)]
    yield from _larger(as_given(measured), bounds, [*_CELL, "precision"], ("max_abs",), "measured", "contract")
    share, room = TIGHT
    least = as_given(accuracy[accuracy["coverage"] == "certified"])
    least = least.assign(max_abs=(least["max_abs"] - room) / share)
    yield from _larger(least, bounds, _CELL, ("max_abs",), "certified", "contract")


def _larger(
    weak: pd.DataFrame, strong: pd.DataFrame, key: list[str], maxima: tuple[str, ...], name: str, other: str
) -> Iterator[str]:
    """Sentences where a maximum of the weaker coverage is above that of the stronger one."""
    if weak.empty or strong.empty:
        return
    both = weak.merge(strong[[*key, *maxima]], on=key, suffixes=("", "_more"))
    for metric in maxima:
        for row in both[both[metric] > both[f"{metric}_more"]].to_dict("records"):
            yield f"{_named(row)}: {name} {metric} {row[metric]:.17g} is above {other} {row[f'{metric}_more']:.17g}"


def _named(row: Mapping[Any, Any]) -> str:
    where = f"{row['precision']}, stratum {row['stratum']}" + ("" if row["gated"] else ", ungated")
    return f"{Formula.of_row(row)} at alpha {row['alpha']:g} in {where}"
