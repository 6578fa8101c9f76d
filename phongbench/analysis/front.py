"""Error/time front with uncertainty.

A *cell* here is one formula at one precision. Its error comes from accuracy rows at the requested alpha, its time from
timing rows; time depends neither on alpha nor on the beta policy, so the join leaves both out. Ratios are over the time
of exact Phong in the same run, with a 99 % interval.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from phongbench.analysis.exponents import Exponents
from phongbench.analysis.kernel_times import WHOLE_POWER, timed, timed_precision, times_at, times_of
from phongbench.analysis.target_costs import checked, own_prices, priced, same_cost, unit_of
from phongbench.errors import UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results.provenance import fingerprint_machine
from phongbench.results.records import Records, Row, by, first_of, key
from phongbench.results.runs import DEFAULT_ROOT, Run, intact
from phongbench.results.schema import CELL, CPU, ERROR_METRICS, INPUT, KERNEL, TABLES
from phongbench.targets.measured import Shelf

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = [*CELL, "error", "ns", "ratio", "ratio_low", "ratio_high", "state"]
SPAN = ("ratio", "ratio_low", "ratio_high")
#: vectors that are unit, on which errors are told
UNIT = {"perturbation": "none", "length_error": 0.0, "gated": True, "truth": "angle"}


def errors_at(
    accuracy: Records,
    *,
    alpha: float | Exponents,
    metric: str = "max_abs",
    stratum: str = "highlight",
    precision: str = "float32",
) -> list[Row]:
    """Errors of gated cells on unit vectors against Phong of the true angle: rows of CELL + `error`, sorted by name.

    accuracy   rows as in accuracy.parquet
    alpha      one that the run swept, or several: a cell's error is its worst over those of the run's that are asked
               about, and a cell that takes only some of them is left out
    metric     of schema.ERROR_METRICS; the errors are in its unit
    stratum    of unit vectors
    precision  a name that the rows know; of fixed point and others that are emulated, too
    Raises UnknownNameError, listing the known ones, and InputError for an alpha that was not measured.
    """
    if metric not in ERROR_METRICS:
        raise UnknownNameError("metric", metric, ERROR_METRICS)
    for column, wanted in (("stratum", stratum), ("precision", precision)):
        if wanted not in (known := accuracy.distinct(column)):
            raise UnknownNameError(column, wanted, known)
    accuracy, exponents = accuracy.as_given(), Exponents.of(alpha)
    meant = accuracy.at(**UNIT, stratum=stratum, precision=precision, alpha=_alphas(accuracy, exponents))
    return worst_of(whole_or_any(errors_of(meant.strongest(), metric), exponents))


def _alphas(accuracy: Records, exponents: Exponents) -> tuple[float, ...]:
    """The measured exponents that are asked about."""
    return exponents.measured(accuracy.distinct("alpha"))


def errors_of(rows: Records, metric: str, *more: str) -> list[Row]:
    """The rows with this metric as their `error`: CELL, INPUT, `error` and any others."""
    columns = [*CELL, *INPUT, metric, *more]
    return [{"error" if name == metric else name: row[name] for name in columns} for row in rows.rows(columns)]


def finite(rows: Records, *more: str) -> list[Row]:
    """Rows of `errors_of` their largest errors, of cells all of whose values are finite in all of these rows."""
    cell, known = key(CELL), errors_of(rows, "max_abs", "nonfinite", *more)
    strange = {cell(row) for row in known if row["nonfinite"]}
    kept = [row for row in known if row["error"] is not None and cell(row) not in strange]
    return [{name: value for name, value in row.items() if name != "nonfinite"} for row in kept]


def whole_or_any(rows: list[Row], exponents: Exponents) -> list[Row]:
    """The rows; without integer powers where every exponent of a range is meant, since they take whole ones only."""
    return [row for row in rows if row["approximation"] != WHOLE_POWER] if exponents.continuous else rows


def worst_of(rows: Iterable[Row]) -> list[Row]:
    """Each cell's row with the largest `error`, sorted by name; cells that lack an input others have are left out.

    rows  CELL, INPUT, `error` and any others; an error that is no number counts as the largest
    """
    first = first_of(sorted(rows, key=by([*CELL, "error"])), [*CELL, *INPUT])
    inputs, cell = len({*map(key(INPUT), first)}), key(CELL)
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in first:
        groups.setdefault(cell(row), []).append(row)
    return [mine[-1] for mine in groups.values() if len(mine) == inputs]


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
    accuracy: Records,
    timing: Records,
    *,
    alpha: float | Exponents,
    precision: str = "float32",
    working_set: str = "l1",
    **errors: str,
) -> list[Row]:
    """Cells at one alpha, or over several, with error, time and whether they lie on the error/time front.

    accuracy, timing   rows as in accuracy.parquet and timing.parquet
    alpha, precision   as for `errors_at`
    working_set        whose times: l1, l2 or memory
    errors             metric and stratum, as for `errors_at`
    returns            rows of COLUMNS, fastest first; a cell without a timing row, an error or an interval is left out
    Raises UnknownNameError and InputError as `errors_at`.
    """
    wrong = errors_at(accuracy, alpha=alpha, precision=precision, **errors)
    alphas = _alphas(accuracy, Exponents.of(alpha))
    return joined(wrong, times_at(times_of(timing, working_set=working_set, precision=precision), alphas))


def joined(wrong: Iterable[Row], times: Iterable[Row]) -> list[Row]:
    """The front of cells with an `error` and of kernels with times; other columns of the cells are kept at the end.

    Cells without an error or an interval are left out.
    """
    kernel = key(KERNEL)
    known = {kernel(row): row for row in times}
    cells = [{**row, **known[kernel(row)]} for row in wrong if kernel(row) in known]
    return judged([row for row in cells if whole(row, "error", *SPAN)])


def whole(row: Row, *names: str) -> bool:
    """Whether it has a value in each of these columns."""
    return all(row[name] is not None for name in names)


def judged(cells: Sequence[Row]) -> list[Row]:
    """Cells with errors and ratios in order, each with its state; other columns are kept at the end."""
    numbers = ([np.nan if row[n] is None else row[n] for row in cells] for n in ("error", "ratio_low", "ratio_high"))
    error, low, high = numbers
    named = states(error, low, high, same_cost(cells))
    rows = [{**row, "state": state} for row, state in zip(cells, named, strict=True)]
    return [_in_order(row) for row in sorted(rows, key=by(["ratio", "error", *CELL]))]


def _in_order(row: Row) -> Row:
    more = [name for name in row if name not in (*COLUMNS, *INPUT)]
    return {name: row[name] for name in (*COLUMNS, *more)}


def framed(rows: Sequence[Row]) -> pd.DataFrame:
    """Rows of a front as a table, typed even where there are none."""
    import pandas as pd

    types = {name: kind for name, kind in TABLES["timing"].types.items() if name in COLUMNS}
    frame = pd.DataFrame(list(rows), columns=None if rows else COLUMNS)
    return frame.astype(types | dict.fromkeys(("error", "ns"), "float64") | {"state": "str"})


def points(
    run: Run,
    *,
    alpha: float | str | Exponents,
    metric: str = "max_abs",
    stratum: str | None = None,
    precision: str = "float32",
    working_set: str = "l1",
    space: str = "reflect",
    target: str = CPU,
    short_of: str | None = None,
    root: Shelf = DEFAULT_ROOT,
) -> dict[str, Any]:
    """The front of a stored run as plain data: what was requested, and `points`, fastest first.

    alpha  one exponent, several, or a range, as `Exponents.of` reads them
    metric, precision, working_set   as for `front`
    stratum  as for `front`; None: highlight, and of (N, H) configurations where the run has them
    ns     None in every point where the run was timed on another kind of machine
    space  reflect, or half: formulas of (N, H), of which the stratum highlight holds coplanar vectors only
    target, short_of   whose costs count, and which unit's: another target's stand instead of the run's times
    root   the folder of the runs, in which measured targets were added, or the measurement of the only one
    Raises CorruptRunError for a run whose bytes have changed, and InputError for one that is partial or was not timed;
    UnknownNameError for a name that the run does not hold.
    """
    exponents, accuracy, notes = Exponents.of(alpha), intact(run).records("accuracy"), list[str]()
    if space not in (known := accuracy.distinct("space")):
        raise UnknownNameError("space", space, known)
    accuracy = accuracy.at(space=space)
    stratum = stratum or usual_stratum(accuracy, space, precision)
    question = {"metric": metric, "stratum": stratum, "precision": precision, "working_set": working_set}
    if space == "half" and stratum != CONFIGURATIONS:
        notes.append(f"the stratum {stratum} holds coplanar vectors only, where N.H tells the angle of R and V")
    if checked(target, short_of, root) == CPU:
        cells = front(accuracy, timed(run), alpha=exponents, **question)
        cells = cells if of_this_machine(run) else [{**row, "ns": None} for row in cells]
    else:
        wrong = errors_at(accuracy, alpha=exponents, metric=metric, stratum=stratum, precision=precision)
        alphas = _alphas(accuracy, exponents)
        own = own_prices(run.records("costs"), target, short_of, precision, notes)
        cells = judged(priced(wrong, alphas, target, short_of, notes, root, own))
    return {
        "run": run.id,
        "alpha": str(exponents),
        "alphas": list(_alphas(accuracy, exponents)),
        **question,
        "space": space,
        "timed_precision": timed_precision(precision),
        "same_machine": of_this_machine(run),
        "target": target,
        **unit_of(target, root),
        "notes": notes,
        "points": [{"name": str(Formula.of_row(row)), **row} for row in cells],
    }


def usual_stratum(accuracy: Records, space: str, precision: str) -> str:
    """The stratum of unit vectors that a formula's error is told of: that where its highlight is; of (N, H)
    configurations of N, L and V, since it is no function of the angle between R and V.
    """
    measured = accuracy.as_given().at(precision=precision, space="half", stratum=CONFIGURATIONS)
    return CONFIGURATIONS if space == "half" and len(measured) else "highlight"


def records(cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows as plain data for JSON: None for what is missing."""
    columns = {str(name): natives(cells[name]) for name in cells.columns}
    for name, values in columns.items():
        if (gone := cells[name].isna().to_numpy()).any():
            columns[name] = [None if lacking else value for value, lacking in zip(values, gone, strict=True)]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def natives(column: pd.Series) -> list[Any]:
    """The values of a column as Python's own numbers and strings, in a tenth of the time of `to_dict`."""
    values: list[Any] = column.tolist()
    return [v.item() if isinstance(v, np.generic) else v for v in values] if column.dtype == object else values


def of_this_machine(run: Run) -> bool:
    """False if the run was timed on another kind of machine: its nanoseconds mean nothing here, only its ratios."""
    return run.manifest["provenance"].get("machine_fingerprint") in (None, fingerprint_machine())
