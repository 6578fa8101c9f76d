"""Error/time front with uncertainty.

A *cell* here is one formula at one precision. Its error comes from accuracy rows at the requested alpha, its time from
timing rows; time depends neither on alpha nor on the beta policy, so the join leaves both out. Ratios are over the time
of exact Phong in the same run, with a 99 % interval.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from phongbench.analysis.exponents import Exponents
from phongbench.analysis.kernel_times import WHOLE_POWER, timed, timed_precision, times_at, times_of
from phongbench.analysis.target_costs import checked, own_prices, priced, same_cost, unit_of
from phongbench.errors import UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.inputs.strata import CONFIGURATIONS
from phongbench.results.provenance import fingerprint_machine
from phongbench.results.runs import DEFAULT_ROOT, Run, as_given, intact, strongest
from phongbench.results.schema import CASE, CELL, CPU, ERROR_METRICS, INPUT, KERNEL
from phongbench.targets.measured import Shelf

COLUMNS = [*CELL, "error", "ns", "ratio", "ratio_low", "ratio_high", "state"]


def errors_at(
    accuracy: pd.DataFrame,
    *,
    alpha: float | Exponents,
    metric: str = "max_abs",
    stratum: str = "highlight",
    precision: str = "float32",
) -> pd.DataFrame:
    """Errors of gated cells on unit vectors against Phong of the true angle: columns CELL + `error`, sorted by name.

    accuracy   rows as in accuracy.parquet
    alpha      one that the run swept, or several: a cell's error is its worst over those of the run's that are asked
               about, and a cell that takes only some of them is left out
    metric     of schema.ERROR_METRICS; the errors are in its unit
    stratum    of unit vectors
    precision  a name that the rows know; of fixed point and others that are emulated, too
    Raises UnknownNameError, listing the known ones, and InputError for an alpha that was not measured.
    """
    return worst_of(_errors(accuracy, Exponents.of(alpha), metric, stratum, precision))


def _errors(accuracy: pd.DataFrame, exponents: Exponents, metric: str, stratum: str, precision: str) -> pd.DataFrame:
    """The rows that `errors_at` takes the worst of: columns CELL, INPUT and `error`."""
    if metric not in ERROR_METRICS:
        raise UnknownNameError("metric", metric, ERROR_METRICS)
    for column, wanted in (("stratum", stratum), ("precision", precision)):
        known = sorted(accuracy[column].astype(str).unique())
        if wanted not in known:
            raise UnknownNameError(column, wanted, known)
    accuracy = as_given(accuracy)
    alphas = exponents.measured(accuracy["alpha"].unique())
    unit = (accuracy["perturbation"] == "none") & (accuracy["length_error"] == 0.0) & accuracy["gated"].astype(bool)
    meant = (accuracy["stratum"] == stratum) & (accuracy["precision"] == precision) & (accuracy["truth"] == "angle")
    told = [*CELL, *INPUT, metric]
    needed = [name for name in accuracy.columns if name in {*told, *CASE, "coverage"}]  # a third of what there is
    rows = strongest(accuracy.loc[unit & meant & accuracy["alpha"].isin(alphas), needed])[told]
    return whole_or_any(rows, exponents).rename(columns={metric: "error"})


def whole_or_any(rows: pd.DataFrame, exponents: Exponents) -> pd.DataFrame:
    """The rows; without integer powers where every exponent of a range is meant, since they take whole ones only."""
    return rows[rows["approximation"] != WHOLE_POWER] if exponents.continuous else rows


def worst_of(rows: pd.DataFrame) -> pd.DataFrame:
    """Each cell's row with the largest `error`, sorted by name; cells that lack an input others have are left out.

    rows  columns CELL, INPUT, `error` and any others; an error that is no number counts as the largest
    """
    first = rows.sort_values([*CELL, "error"], kind="stable").drop_duplicates([*CELL, *INPUT])
    inputs = len(first[INPUT].drop_duplicates())
    if inputs == 1:
        return first.reset_index(drop=True)
    groups = first.groupby(CELL, dropna=False, observed=True, sort=True)
    complete = first[groups["error"].transform("size") == inputs]
    return complete.drop_duplicates(CELL, keep="last").reset_index(drop=True)


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
    alpha: float | Exponents,
    precision: str = "float32",
    working_set: str = "l1",
    **errors: str,
) -> pd.DataFrame:
    """Cells at one alpha, or over several, with error, time and whether they lie on the error/time front.

    accuracy, timing   rows as in accuracy.parquet and timing.parquet
    alpha, precision   as for `errors_at`
    working_set        whose times: l1, l2 or memory
    errors             metric and stratum, as for `errors_at`
    returns            columns COLUMNS, fastest first; a cell without a timing row, an error or an interval is left out
    Raises UnknownNameError and InputError as `errors_at`.
    """
    wrong = errors_at(accuracy, alpha=alpha, precision=precision, **errors)
    alphas = Exponents.of(alpha).measured(accuracy["alpha"].unique())
    times = times_at(times_of(timing, working_set=working_set, precision=precision), alphas)
    return joined(wrong, times)


def fronts(
    accuracy: pd.DataFrame, timing: pd.DataFrame, *, precision: str = "float32", working_set: str = "l1"
) -> dict[float, pd.DataFrame]:
    """The front at each exponent by itself, as `front` makes it of the errors in the stratum highlight.

    Made together: what a front takes is the handling of small tables.
    """
    alphas = sorted(float(alpha) for alpha in as_given(accuracy)["alpha"].unique())
    wrong = _errors(accuracy, Exponents(tuple(alphas)), "max_abs", "highlight", precision)
    wrong = wrong.sort_values(["alpha", *CELL, "error"], kind="stable").drop_duplicates([*CELL, *INPUT])
    times = times_of(timing, working_set=working_set, precision=precision)
    each = pd.concat([times_at(times, (alpha,)).assign(alpha=alpha) for alpha in alphas], ignore_index=True)
    cells = _whole(wrong.merge(each, on=[*KERNEL, "alpha"], how="inner"))
    kernels, places = same_cost(cells), cells.groupby("alpha").indices
    state = np.full(len(cells), "", object)
    for here in places.values():
        state[here] = _states(cells.iloc[here], kernels.iloc[here])
    cells = cells.assign(state=pd.Series(state, index=cells.index, dtype="str"))
    return {alpha: _in_order(cells.iloc[places.get(alpha, [])]) for alpha in alphas}


def joined(wrong: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """The front of cells with an `error` and of kernels with times; other columns of the cells are kept at the end."""
    return judged(_whole(wrong.merge(times, on=KERNEL, how="inner")))


def _whole(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells with an error and an interval."""
    return cells.dropna(subset=["error", "ratio", "ratio_low", "ratio_high"]).reset_index(drop=True)


def judged(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells with errors and ratios in order, each with its state; other columns are kept at the end."""
    named = pd.Series(_states(cells, same_cost(cells)), index=cells.index, dtype="str")
    return _in_order(cells.assign(state=named))


def _states(cells: pd.DataFrame, kernels: pd.Series) -> list[str]:
    return states(cells["error"], cells["ratio_low"], cells["ratio_high"], kernels)


def _in_order(cells: pd.DataFrame) -> pd.DataFrame:
    more = [name for name in cells.columns if name not in (*COLUMNS, *INPUT)]
    return cells.sort_values(["ratio", "error", *CELL], kind="stable").reset_index(drop=True)[[*COLUMNS, *more]]


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
    exponents, accuracy, notes = Exponents.of(alpha), intact(run).accuracy, list[str]()
    known = sorted(accuracy["space"].astype(str).unique())
    if space not in known:
        raise UnknownNameError("space", space, known)
    accuracy = accuracy[accuracy["space"] == space]
    stratum = stratum or usual_stratum(accuracy, space, precision)
    question = {"metric": metric, "stratum": stratum, "precision": precision, "working_set": working_set}
    if space == "half" and stratum != CONFIGURATIONS:
        notes.append(f"the stratum {stratum} holds coplanar vectors only, where N.H tells the angle of R and V")
    if checked(target, short_of, root) == CPU:
        cells = front(accuracy, timed(run), alpha=exponents, **question)
        cells = cells if of_this_machine(run) else cells.assign(ns=np.nan)
    else:
        wrong = errors_at(accuracy, alpha=exponents, metric=metric, stratum=stratum, precision=precision)
        alphas = exponents.measured(accuracy["alpha"].unique())
        own = own_prices(run.costs, target, short_of, precision, notes)
        cells = judged(priced(wrong, alphas, target, short_of, notes, root, own))
    return {
        "run": run.id,
        "alpha": str(exponents),
        "alphas": list(exponents.measured(accuracy["alpha"].unique())),
        **question,
        "space": space,
        "timed_precision": timed_precision(precision),
        "same_machine": of_this_machine(run),
        "target": target,
        **unit_of(target, root),
        "notes": notes,
        "points": [{"name": str(Formula.of_row(row)), **row} for row in records(cells)],
    }


def usual_stratum(accuracy: pd.DataFrame, space: str, precision: str) -> str:
    """The stratum of unit vectors that a formula's error is told of: that where its highlight is; of (N, H)
    configurations of N, L and V, since it is no function of the angle between R and V.
    """
    measured = as_given(accuracy[(accuracy["precision"] == precision) & (accuracy["space"] == "half")])
    return CONFIGURATIONS if space == "half" and (measured["stratum"] == CONFIGURATIONS).any() else "highlight"


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
