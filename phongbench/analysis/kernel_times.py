"""What a run tells of the times of kernels: one row each, for the exponents asked about.

Time depends neither on the beta policy nor, but for integer powers, on alpha. Ratios are time / time of exact Phong in
the same run, with an interval.
"""

from collections.abc import Sequence

from phongbench.compiler.precisions import FLOAT32, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.results.records import Records, Row, by, first_of, key
from phongbench.results.runs import Run
from phongbench.results.schema import KERNEL

#: The one formula whose time depends on alpha: the exponent it is timed with under its own name; other timed exponents
#: have rows named "integer-power-64" and so on.
WHOLE_POWER, WHOLE_EXPONENT = "integer-power", 50


def timed(run: Run) -> Records:
    """The run's timing rows; InputError says which command makes them where there are none."""
    timing = run.records("timing")
    if not len(timing):
        fix = "time it: phongbench run without --no-timing, or with a larger --timing-budget SECONDS"
        raise InputError("the run has no timing rows", run.id, fix)
    return timing


def multiplications(exponent: int) -> int:
    """Multiplications that square-and-multiply takes for x ** exponent, exponent >= 1."""
    return exponent.bit_length() - 1 + exponent.bit_count() - 1


def _timed_exponent(name: str) -> int | None:
    """The exponent of a timed integer power, None for all other names."""
    head, _, tail = name.rpartition("-")
    if name == WHOLE_POWER:
        return WHOLE_EXPONENT
    return int(tail) if head == WHOLE_POWER and tail.isdigit() else None


def _integer_power_at(times: Sequence[Row], alpha: float) -> list[Row]:
    """The times with one row for integer powers: the cheapest timed one with no fewer multiplications than x ** alpha.

    So its time is an upper bound. No row stands for it where alpha takes more multiplications than any timed exponent,
    or is not whole.
    """
    exponents = {str(row["approximation"]): _timed_exponent(str(row["approximation"])) for row in times}
    work = {name: multiplications(e) for name, e in exponents.items() if e is not None}
    needed = multiplications(int(alpha)) if alpha >= 1 and alpha == int(alpha) else None
    enough = [name for name in work if needed is not None and work[name] >= needed]
    chosen = min(enough, key=lambda name: (work[name], name), default=None)
    kept = [row for row in times if row["approximation"] not in work or row["approximation"] == chosen]
    return [{**row, "approximation": WHOLE_POWER} if row["approximation"] == chosen else row for row in kept]


def times_of(timing: Records, *, working_set: str = "l1", precision: str | None = None) -> list[Row]:
    """One timing row per kernel of a working set: KERNEL + ns, ratio, ratio_low, ratio_high.

    `ns` is ns_min, the minimum over clean epochs. Where several thread counts were timed, the smallest counts.
    precision  only its kernels; emulated ones are never timed: float32 stands for them, same work and order
    """
    if len(timing) and working_set not in (known := timing.distinct("working_set")):
        raise UnknownNameError("working set", working_set, known)
    spans = ["ratio", "ratio_low", "ratio_high"]
    rows = timing.at(working_set=working_set).rows([*KERNEL, "threads", "ns_min", *spans])
    rows = first_of(sorted(rows, key=by([*KERNEL, "threads", "ratio"])), KERNEL)
    told = [
        {**{name: row[name] for name in KERNEL}, "ns": row["ns_min"], **{name: row[name] for name in spans}}
        for row in rows
    ]
    if precision is None:
        return told
    return [{**row, "precision": precision} for row in told if row["precision"] == timed_precision(precision)]


def timed_precision(precision: str) -> str:
    """The precision whose times stand for this one's."""
    return FLOAT32.name if precision_named(precision).rounds else precision


def times_at(times: Sequence[Row], alphas: tuple[float, ...]) -> list[Row]:
    """The times of kernels over several exponents: only integer powers' depend on them, and their slowest counts."""
    slowest = sorted((row for alpha in alphas for row in _integer_power_at(times, alpha)), key=by([*KERNEL, "ratio"]))
    identity = key(KERNEL)
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in slowest:
        groups.setdefault(identity(row), []).append(row)
    return [rows[-1] for rows in groups.values() if len(rows) == len(alphas)]
