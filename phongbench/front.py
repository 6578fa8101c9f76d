"""Error/time front with uncertainty, and the cheapest formula for an error budget.

A *cell* here is one approximation, lambda form, space, beta policy and gamma at one precision. Its error comes from
accuracy rows at the asked alpha, its time from timing rows; time depends neither on alpha nor on the beta policy, so
the join leaves both out. Ratios are time / time of exact Phong in the same run, with an interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from phongbench.errors import InputError, UnknownNameError

#: What names a cell of the front.
CELL = ["approximation", "lambda_form", "space", "beta_policy", "gamma", "precision"]
#: What names the timed kernel a cell runs on.
KERNEL = ["approximation", "lambda_form", "space", "gamma", "precision"]
#: Error metrics a front can be asked for: columns of accuracy.parquet, smaller is better.
METRICS = [
    "max_abs", "mean_abs", "rms", "p50_abs", "p99_abs", "p999_abs", "max_above", "max_below", "codes_8bit",
    "model_max", "length_max", "rounding_max",
]  # fmt: skip
#: The one formula whose time depends on alpha: the exponent it is timed with under its own name; other timed exponents
#: have rows named "integer-power-64" and so on.
WHOLE_POWER, WHOLE_EXPONENT = "integer-power", 50
COLUMNS = [*CELL, "error", "ns", "ratio", "ratio_low", "ratio_high", "state"]


@dataclass(frozen=True)
class Choice:
    """Answer to an error budget.

    best          row of `front` or None   cheapest cell whose error is within the budget
    runner_up     row of `front` or None   the next cheapest one
    resolved      bool                     the intervals of best and runner_up do not overlap
    nearest_miss  row of `front` or None   cell with the smallest error beyond the budget
    """

    best: pd.Series | None
    runner_up: pd.Series | None
    resolved: bool
    nearest_miss: pd.Series | None


def errors_at(
    accuracy: pd.DataFrame,
    *,
    alpha: float,
    metric: str = "max_abs",
    stratum: str = "highlight",
    precision: str = "float32",
    truth: str = "angle",
) -> pd.DataFrame:
    """Cells with unit vectors and the a.b > 0 gate, and their error: columns CELL + `error`, sorted by name.

    alpha   float   must be one the run swept
    Unknown names raise InputError, listing the known ones.
    """
    if metric not in METRICS:
        raise UnknownNameError("metric", metric, METRICS)
    for column, wanted in (("stratum", stratum), ("precision", precision), ("truth", truth)):
        known = sorted(accuracy[column].astype(str).unique())
        if wanted not in known:
            raise UnknownNameError(column, wanted, known)
    near = np.isclose(accuracy["alpha"].to_numpy(dtype=np.float64), alpha, rtol=1e-9, atol=0.0)
    if not near.any():
        raise UnknownNameError("alpha", f"{alpha:g}", [f"{a:g}" for a in sorted(accuracy["alpha"].unique())])
    unit = (accuracy["perturbation"] == "none") & (accuracy["length_error"] == 0.0) & accuracy["gated"].astype(bool)
    asked = (accuracy["stratum"] == stratum) & (accuracy["precision"] == precision) & (accuracy["truth"] == truth)
    rows: pd.DataFrame = accuracy.loc[near & unit & asked, [*CELL, metric]].rename(columns={metric: "error"})
    return rows.sort_values(CELL, kind="stable").drop_duplicates(CELL).reset_index(drop=True)


def multiplications(exponent: int) -> int:
    """Multiplications that square-and-multiply takes for x ** exponent, exponent >= 1."""
    return exponent.bit_length() - 1 + exponent.bit_count() - 1


def _timed_exponent(name: str) -> int | None:
    """The exponent of a timed integer power, None for all other names."""
    head, _, tail = name.rpartition("-")
    if name == WHOLE_POWER:
        return WHOLE_EXPONENT
    return int(tail) if head == WHOLE_POWER and tail.isdigit() else None


def _integer_power_at(times: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """The times with one row for integer powers: the cheapest timed one with no fewer multiplications than x ** alpha.

    So its time is an upper bound. No row stands for it where alpha takes more multiplications than any timed exponent,
    or is not whole.
    """
    exponents = {str(name): _timed_exponent(str(name)) for name in times["approximation"].unique()}
    work = {name: multiplications(e) for name, e in exponents.items() if e is not None}
    needed = multiplications(int(alpha)) if alpha >= 1 and alpha == int(alpha) else None
    enough = [name for name in work if needed is not None and work[name] >= needed]
    chosen = min(enough, key=lambda name: (work[name], name), default=None)
    kept = times[~times["approximation"].isin([name for name in work if name != chosen])]
    renamed = {chosen: WHOLE_POWER} if chosen else {}
    return kept.assign(approximation=kept["approximation"].replace(renamed))


def times_of(timing: pd.DataFrame, *, working_set: str = "l1") -> pd.DataFrame:
    """One timing row per kernel of a working set: columns KERNEL + ns, ratio, ratio_low, ratio_high.

    `ns` is ns_min, the minimum over clean epochs. Where several thread counts were timed, the smallest counts.
    """
    known = sorted(timing["working_set"].astype(str).unique())
    if len(timing) and working_set not in known:
        raise UnknownNameError("working set", working_set, known)
    rows = timing[timing["working_set"] == working_set].sort_values([*KERNEL, "threads", "ratio"], kind="stable")
    rows = rows.drop_duplicates(KERNEL).rename(columns={"ns_min": "ns"})
    return rows[[*KERNEL, "ns", "ratio", "ratio_low", "ratio_high"]]


def states(error: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, kernel: npt.ArrayLike) -> list[str]:
    """On, off or unresolved for every cell, pairwise.

    error    float (n,)   error of the cell, smaller is better
    low      float (n,)   lower end of the time ratio's interval
    high     float (n,)   upper end
    kernel   int (n,)     equal for cells that run the same timed kernel: their times are the same, not merely alike
    returns  list of str  "off" where another cell with no larger error is certainly faster (or has a smaller error on
                          the same kernel); "on" where every other cell with no larger error is certainly slower; else
                          "unresolved"
    """
    wrong, fast, slow, code = np.asarray(error), np.asarray(low), np.asarray(high), np.asarray(kernel)
    rival = (wrong[None, :] <= wrong[:, None]) & ~np.eye(len(wrong), dtype=bool)
    same = code[None, :] == code[:, None]
    beaten: npt.NDArray[np.bool_] = rival & np.where(
        same, wrong[None, :] < wrong[:, None], slow[None, :] < fast[:, None]
    )
    harmless = same | (fast[None, :] > slow[:, None])
    unclear: npt.NDArray[np.bool_] = rival & ~harmless
    named = np.where(beaten.any(axis=1), "off", np.where(unclear.any(axis=1), "unresolved", "on"))
    return [str(state) for state in named]


def front(
    accuracy: pd.DataFrame,
    timing: pd.DataFrame,
    *,
    alpha: float,
    metric: str = "max_abs",
    stratum: str = "highlight",
    precision: str = "float32",
    working_set: str = "l1",
    truth: str = "angle",
) -> pd.DataFrame:
    """Cells at one alpha with error, time and whether they lie on the error/time front.

    accuracy, timing   rows as in accuracy.parquet and timing.parquet
    returns            columns COLUMNS, fastest first; a cell without a timing row, an error or an interval is left out
    """
    wrong = errors_at(accuracy, alpha=alpha, metric=metric, stratum=stratum, precision=precision, truth=truth)
    times = _integer_power_at(times_of(timing, working_set=working_set), alpha)
    cells = wrong.merge(times, on=KERNEL, how="inner")
    cells = cells.dropna(subset=["error", "ratio", "ratio_low", "ratio_high"]).reset_index(drop=True)
    kernel = cells.groupby(KERNEL, dropna=False, observed=True, sort=True).ngroup()
    cells["state"] = pd.Series(
        states(cells["error"], cells["ratio_low"], cells["ratio_high"], kernel), index=cells.index, dtype="str"
    )
    return cells.sort_values(["ratio", "error", *CELL], kind="stable").reset_index(drop=True)[COLUMNS]


def cheapest(
    accuracy: pd.DataFrame,
    timing: pd.DataFrame,
    *,
    alpha: float,
    max_error: float,
    metric: str = "max_abs",
    stratum: str = "highlight",
    precision: str = "float32",
    working_set: str = "l1",
    truth: str = "angle",
) -> Choice:
    """The cheapest cell whose error is within `max_error`, the next one, and the nearest miss.

    max_error   float > 0   absolute budget in the metric's unit, 1/255 for one 8-bit code
    """
    if not max_error > 0.0:
        raise InputError(
            f"the error budget must be above 0, not {max_error!r}", "max_error", "one 8-bit code is 0.0039"
        )
    cells = front(
        accuracy, timing, alpha=alpha, metric=metric, stratum=stratum, precision=precision,
        working_set=working_set, truth=truth,
    )  # fmt: skip
    return choose(cells, max_error)


def choose(cells: pd.DataFrame, max_error: float) -> Choice:
    """`cheapest` for cells already joined by `front`.

    Variants of one kernel (beta policies) take the same time; only the most accurate of them stands for it.
    """
    one_each = cells.sort_values(["ratio", "error", *CELL], kind="stable").drop_duplicates(KERNEL)
    fits = one_each[one_each["error"] <= max_error]
    misses = cells[cells["error"] > max_error].sort_values(["error", "ratio", *CELL], kind="stable")
    best = fits.iloc[0] if len(fits) else None
    second = fits.iloc[1] if len(fits) > 1 else None
    resolved = best is not None and second is not None and bool(best["ratio_high"] < second["ratio_low"])
    return Choice(best, second, resolved, misses.iloc[0] if len(misses) else None)
