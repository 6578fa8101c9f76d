"""What a run tells of the times of kernels: one row each, for the exponents asked about.

Time depends neither on the beta policy nor, but for integer powers, on alpha. Ratios are time / time of exact Phong in
the same run, with an interval.
"""

import pandas as pd

from phongbench.compiler.lowering import FLOAT32, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.results.runs import Run, with_raw
from phongbench.results.schema import KERNEL

#: The one formula whose time depends on alpha: the exponent it is timed with under its own name; other timed exponents
#: have rows named "integer-power-64" and so on.
WHOLE_POWER, WHOLE_EXPONENT = "integer-power", 50


def timed(run: Run) -> pd.DataFrame:
    """The run's timing rows; InputError says which command makes them where there are none."""
    if run.timing.empty:
        fix = "time it: phongbench run without --no-timing, or with a larger --timing-budget SECONDS"
        raise InputError("the run has no timing rows", run.id, fix)
    return run.timing


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


def times_of(timing: pd.DataFrame, *, working_set: str = "l1", precision: str | None = None) -> pd.DataFrame:
    """One timing row per kernel of a working set: columns KERNEL + ns, ratio, ratio_low, ratio_high.

    `ns` is ns_min, the minimum over clean epochs. Where several thread counts were timed, the smallest counts.
    precision  only its kernels; emulated ones are never timed: float32 stands for them, same work and order
    """
    timing = with_raw(timing)
    known = sorted(timing["working_set"].astype(str).unique())
    if len(timing) and working_set not in known:
        raise UnknownNameError("working set", working_set, known)
    rows = timing[timing["working_set"] == working_set].sort_values([*KERNEL, "threads", "ratio"], kind="stable")
    rows = rows.drop_duplicates(KERNEL).rename(columns={"ns_min": "ns"})
    if precision is not None:
        rows = rows[rows["precision"] == timed_precision(precision)].assign(precision=precision)
    return rows[[*KERNEL, "ns", "ratio", "ratio_low", "ratio_high"]]


def timed_precision(precision: str) -> str:
    """The precision whose times stand for this one's."""
    return FLOAT32.name if precision_named(precision).rounds else precision


def times_at(times: pd.DataFrame, alphas: tuple[float, ...]) -> pd.DataFrame:
    """The times of kernels over several exponents: only integer powers' depend on them, and their slowest counts."""
    if len(alphas) == 1:
        return _integer_power_at(times, alphas[0]).sort_values([*KERNEL, "ratio"], kind="stable").reset_index(drop=True)
    each = pd.concat([_integer_power_at(times, alpha) for alpha in alphas], ignore_index=True)
    slowest = each.sort_values([*KERNEL, "ratio"], kind="stable")
    everywhere = slowest.groupby(KERNEL, dropna=False, observed=True)["ns"].transform("size") == len(alphas)
    return slowest[everywhere].drop_duplicates(KERNEL, keep="last").reset_index(drop=True)
