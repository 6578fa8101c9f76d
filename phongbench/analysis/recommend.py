"""Which formula to ship for an error budget: the cheapest one whose largest error is within it, and why.

A run answers by measurement; without one the closed-form laws answer, which know errors but no times. Errors are taken
on unit vectors (highlight, uniform and peak strata, and what a search found, if the run made one) and, where wrong
lengths are allowed, on every kind of them up to that size, against Phong of the true angle. Maxima over samples and of
searches are lower bounds: the answer says so, and tells the proven bound of the formula's own error where there is one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from phongbench.analysis import front, kernel_times, law_bounds
from phongbench.analysis.exponents import Exponents
from phongbench.analysis.law_bounds import Wish
from phongbench.compiler.lowering import precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import cell_name
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import SPACES, Setting
from phongbench.results import runs
from phongbench.results.runs import DEFAULT_ROOT, Run
from phongbench.results.schema import CELL, INPUT, TWIN

#: strata of unit vectors that a budget must hold on; the last is the search's, which looks at nearly unit ones
STRATA = ("highlight", "uniform", "peak", "vectors")


def recommend(
    run: Run | None,
    *,
    alpha: Exponents | float | str,
    max_error: float | str,
    length_error: float | str | None = None,
    precision: str = "float32",
    space: str = "reflect",
    working_set: str = "l1",
) -> dict[str, Any]:
    """The cheapest formula within an error budget, the next cheapest, and the nearest miss, as plain data.

    run                  a stored run with timing rows, or None: answer from the laws
    alpha                exact Phong's exponent, > 0: one, several or a range, as `Exponents.of` reads them; an error is
                         the worst over all of them
    max_error            largest absolute error allowed, above 0; text may be a fraction such as 1/255
    length_error         how wrong vector lengths may be, relative, >= 0: 0.01 is up to 1 %; None for unit vectors
    precision            a name that `precision_named` knows
    space                reflect (R, V), or half (N, H), whose errors hold for coplanar vectors only
    working_set          whose times count: l1, l2 or memory
    returns              basis ("run" or "laws"), run, what was asked, `choices` (best, then next; empty where nothing
                         meets the budget), `nearest_miss`, `notes` in words
    Raises InputError for numbers out of range and for what the run did not measure, naming the command that does;
    UnknownNameError for an unknown precision or space; CorruptRunError for a run whose bytes have changed.
    """
    wish = Wish(
        Exponents.of(alpha),
        _above(number(max_error, "max_error"), "max_error"),
        _at_least(number(length_error or 0.0, "length_error"), "length_error"),
        precision,
        space,
        working_set,
    )
    precision_named(precision)
    if space not in SPACES:
        raise UnknownNameError("space", space, SPACES)
    notes: list[str] = []
    cells = law_bounds.cells(wish, notes) if run is None else _by_run(run, wish, notes)
    choice = front.choose(cells, wish.max_error)
    found = [_told(_plain(row), wish) for row in (choice.best, choice.runner_up) if row is not None]
    miss = None if choice.nearest_miss is None else _told(_plain(choice.nearest_miss), wish)
    for told, other in zip(found, [*found[1:], None], strict=False):
        told["why"] = _why(told, other, wish, choice.resolved)
    if miss is not None:
        miss["why"] = (
            f"beyond {wish.max_error:.4g} by a factor of {miss['max_abs'] / wish.max_error:.3g}: "
            + "; ".join((_basis(miss, wish), _cost(miss)))
        )
    return {
        "basis": "laws" if run is None else "run",
        "run": None if run is None else run.id,
        "alpha": str(wish.alpha),
        "max_error": wish.max_error,
        "length_error": wish.length_error,
        "precision": precision,
        "space": space,
        "working_set": working_set,
        "choices": found,
        "nearest_miss": miss,
        "notes": notes,
    }


def number(value: float | str, name: str) -> float:
    """A number, or text such as 0.004, 1e-3 or 1/255; InputError names the option where it is neither."""
    try:
        return float(Fraction(value.replace(" ", ""))) if isinstance(value, str) else float(value)
    except (ValueError, ZeroDivisionError, OverflowError) as problem:
        raise InputError(f"{value!r} is not a number", name, "write 0.004 or 1/255") from problem


def run_for(name: str | None, root: Path = DEFAULT_ROOT) -> Run | None:
    """The run of this name; without one, the newest whole run with times; None where there is none.

    name  an id under `root`, `latest` or a folder; InputError where there is no such run
    """
    if name is not None:
        return runs.find(name, root)
    whole = (run for run in reversed(runs.stored(root)) if run.complete)
    return next((run for run in whole if run.manifest["files"].get("timing.parquet", {}).get("rows", 0)), None)


def _above(value: float, name: str) -> float:
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"the error budget must be above 0, not {value:g}", name, "one 8-bit code is 1/255")
    return value


def _at_least(value: float, name: str) -> float:
    if not (math.isfinite(value) and value >= 0):
        raise InputError(f"a length error of {value:g} is not one", name, "0.01 allows lengths up to 1 % wrong")
    return value


# by measurement


def _by_run(run: Run, wish: Wish, notes: list[str]) -> pd.DataFrame:
    """The cells that apply, with their errors and times."""
    accuracy, timing = runs.intact(run).accuracy, kernel_times.timed(run)
    vouching = _alphas(run, accuracy, wish, notes)
    rows = accuracy[accuracy["alpha"].isin(vouching) & accuracy["gated"] & (accuracy["truth"] == "angle")]
    rows = rows[(rows["precision"] == wish.precision) & (rows["space"] == wish.space)]
    if rows.empty:
        _refuse(run, wish, accuracy)
    rows = _inputs(run, rows, wish, notes)
    bad = rows.groupby(CELL, dropna=False, observed=True)["nonfinite"].transform("sum") > 0
    rows = front.whole_or_any(rows[~bad & rows["max_abs"].notna()], wish.alpha)
    columns = [*CELL, *INPUT, "max_abs", "samples", "coverage"]
    worst = front.worst_of(rows[columns].rename(columns={"max_abs": "error"}))
    worst = worst[[_applies(row, wish.alpha) for row in front.records(worst)]]
    worst = worst.merge(_bounds(accuracy, vouching), on=_LAW, how="left")
    times = kernel_times.times_of(timing, working_set=wish.working_set, precision=wish.precision)
    cells = front.joined(worst, kernel_times.times_at(times, wish.alpha.values))
    if cells.empty:
        fix = f"time it: phongbench run --precision {wish.precision}"
        raise InputError(f"no formula in {wish.precision} was timed in {wish.working_set}", run.id, fix)
    _warn(run, timing, wish, notes)
    return cells if front.of_this_machine(run) else cells.assign(ns=np.nan)


_LAW = [name for name in CELL if name != "precision"]


def _bounds(accuracy: pd.DataFrame, alphas: tuple[float, ...]) -> pd.DataFrame:
    """The proven bound of each formula's own error over these exponents, where there is one at each: `certified`."""
    rows = accuracy[(accuracy["coverage"] == "certified") & accuracy["alpha"].isin(alphas)]
    groups = rows.groupby(_LAW, dropna=False, observed=True)["model_max"]
    found = groups.max()[groups.size() == len(alphas)]
    return found.rename("certified").reset_index()


def _alphas(run: Run, accuracy: pd.DataFrame, wish: Wish, notes: list[str]) -> tuple[float, ...]:
    """The run's exponents that vouch for those asked about."""
    known = sorted(accuracy["alpha"].unique())
    found = wish.alpha.around(known)
    if found is None:
        listed = ",".join(f"{value:g}" for value in wish.alpha.values)
        fix = f"measure it: phongbench run --alpha {listed}, or name another run with --run"
        raise InputError(
            f"alpha {wish.alpha} lies outside what the run measured, {known[0]:g} .. {known[-1]:g}", run.id, fix
        )
    missing = [value for value in wish.alpha.values if not any(math.isclose(value, one) for one in found)]
    if missing:
        near = ", ".join(f"{value:g}" for value in found)
        what = " and ".join(f"{value:g}" for value in missing)
        notes.append(f"alpha {what} was not measured: its neighbours vouch for it, by the worst of alpha {near}")
    elif wish.alpha.continuous:
        notes.append(f"alpha {wish.alpha} is judged by the worst of the {len(found)} exponents measured there")
    return found


def _refuse(run: Run, wish: Wish, accuracy: pd.DataFrame) -> None:
    held = ", ".join(sorted(f"{p} {s}" for p, s in set(zip(accuracy["precision"], accuracy["space"], strict=True))))
    fix = f"measure it: phongbench run --precision {wish.precision}"
    raise InputError(f"no cells in {wish.precision}, {wish.space} space; the run holds {held}", run.id, fix)


def _inputs(run: Run, rows: pd.DataFrame, wish: Wish, notes: list[str]) -> pd.DataFrame:
    """The rows of unit vectors, and those of wrong lengths up to the smallest measured one that covers the wish."""
    unit = rows["stratum"].isin(STRATA)
    if not unit.any():
        fix = 'measure them: phongbench run with a plan whose strata include "highlight"'
        raise InputError(f"the run holds none of the strata {', '.join(STRATA)}", run.id, fix)
    if not wish.length_error:
        return rows[unit]
    # a cause's error is of one kind only; that a length may be wrong by so much says nothing on which way
    wrong = (rows["stratum"] == "lengths") & rows["perturbation"].isin(("a", "both", "opposite"))
    sizes = np.sort(rows.loc[wrong, "length_error"].abs().unique())
    reached = sizes[sizes >= wish.length_error * (1 - 1e-9)]
    if not len(sizes):
        fix = f'measure them: a plan with strata = ["highlight", "lengths"] and length_spaces = ["{wish.space}"]'
        raise InputError(f"the run holds no vectors of wrong length in {wish.space} space", run.id, fix)
    if not len(reached):
        fix = "ask for less, or normalise the vectors first"
        raise InputError(f"the wrongest lengths measured are {sizes[-1]:g}, not {wish.length_error:g}", run.id, fix)
    if not math.isclose(reached[0], wish.length_error):
        notes.append(f"lengths are judged at {reached[0]:g} wrong, the nearest that was measured and not less")
    kept: pd.DataFrame = rows[unit | (wrong & (rows["length_error"].abs() <= reached[0]))]
    return kept


def _applies(cell: Mapping[str, Any], alpha: Exponents) -> bool:
    """False for a formula of ours that does not take an exponent asked about."""
    spec = REGISTRY.get(str(cell["approximation"]))
    middle = (math.sqrt(alpha.values[0] * alpha.values[-1]),) if alpha.continuous else ()
    settings = (_setting(cell, value) for value in (*alpha.values, *middle))
    return spec is None or all(spec.accepts(setting) for setting in settings)


def _setting(cell: Mapping[str, Any], alpha: float) -> Setting:
    gamma = None if pd.isna(cell["gamma"]) else int(cell["gamma"])
    return Setting(alpha, gamma, str(cell["beta_policy"]), str(cell["space"]))


def _warn(run: Run, timing: pd.DataFrame, wish: Wish, notes: list[str]) -> None:
    if kernel_times.timed_precision(wish.precision) != wish.precision:
        notes.append(
            f"{wish.precision} is emulated here, so its time says nothing: formulas are ordered by the times of the "
            f"same kernels in {kernel_times.timed_precision(wish.precision)}"
        )
    twin = timing[(timing["approximation"] == TWIN) & (timing["working_set"] == wish.working_set)]
    if (twin["verdict"] != "unresolved").any():
        notes.append("the run told identical code apart, so no claim to be faster is made: time it again when quiet")
    if not front.of_this_machine(run):
        notes.append("the run was timed on another kind of machine: its ratios hold there, nanoseconds are left out")
    if wish.space == "half":
        notes.append("formulas of (N, H) were measured on coplanar vectors, and agree with Phong only there")


# in words


def _plain(cell: pd.Series) -> dict[str, Any]:
    return {str(name): value for name, value in cell.to_dict().items()}


def _told(cell: Mapping[str, Any], wish: Wish) -> dict[str, Any]:
    """A cell as plain data."""
    spec = REGISTRY.get(str(cell["approximation"]))
    setting, by_laws = _setting(cell, wish.alpha.values[0]), cell["coverage"] == "law"
    single = len(wish.alpha.values) == 1 and spec is not None
    beta = spec.coefficients(setting).get("beta") if single and spec else None
    times = {name: None if by_laws else cell[name] for name in ("ns", "ratio", "ratio_low", "ratio_high")}
    numbers = {name: None if value is None or pd.isna(value) else float(value) for name, value in times.items()}
    return {
        "name": cell_name(cell),
        "approximation": str(cell["approximation"]),
        "lambda": str(cell["lambda_form"]),
        "space": setting.space,
        "gamma": setting.gamma,
        "beta": None if beta is None else float(beta),
        "beta_policy": setting.slope,
        "precision": wish.precision,
        "formula": spec.formula if spec else None,
        "max_abs": float(cell["error"]),
        "codes_8bit": 255 * float(cell["error"]),
        "coverage": str(cell["coverage"]),
        "samples": None if by_laws else int(cell["samples"]),
        **numbers,
        "certified": None if pd.isna(cell.get("certified", np.nan)) else float(cell["certified"]),
        "work": float(cell["ratio"]) if by_laws else None,
    }


def _basis(told: Mapping[str, Any], wish: Wish) -> str:
    """Its error and what the number rests on."""
    lengths = f" and lengths up to {wish.length_error:.3g} wrong" if wish.length_error else ""
    head = f"largest error {told['max_abs']:.3g} ({told['codes_8bit']:.2g} 8-bit codes) at alpha {wish.alpha}{lengths}"
    if told["coverage"] == "law":
        return f"{head}, by law"
    proven = "" if told["certified"] is None else f"; the formula alone errs by at most {told['certified']:.3g}, proven"
    if told["coverage"] == "sampled":
        return (
            f"{head}, the largest of {told['samples']:,} samples a stratum: a lower bound of the true maximum{proven}"
        )
    if told["coverage"] == "searched":
        return f"{head}, the worst that a search found: a lower bound of the true maximum{proven}"
    return f"{head}, {told['coverage']}{proven}"


def _cost(told: Mapping[str, Any]) -> str:
    if told["ratio"] is None:
        return f"about {told['work']:.0f} operations an element, counted and not timed"
    return f"{told['ratio']:.3g} of exact Phong's time (interval {told['ratio_low']:.3g} .. {told['ratio_high']:.3g})"


def _why(told: Mapping[str, Any], other: Mapping[str, Any] | None, wish: Wish, resolved: bool) -> str:
    """Why it is chosen, and how sure it is that the next one is slower."""
    parts = [_basis(told, wish), f"within {wish.max_error:.4g}", _cost(told)]
    if other is not None and told["ratio"] is None:
        parts.append(f"the next, {other['name']}, takes about {other['work']:.0f}")
    elif other is not None:
        sure = "surely slower" if resolved else "which is faster is not settled, the intervals overlap"
        parts.append(f"the next, {other['name']}, takes {other['ratio']:.3g}: {sure}")
    return "; ".join(parts)
