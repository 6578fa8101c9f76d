"""What formulas cost on a compiled target, beside their errors: counted from machine code, without an interval."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

import pandas as pd

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.results.schema import KERNEL
from phongbench.targets.chips import TARGETS
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.costs import CostTable, shipped
from phongbench.targets.measure import Cost
from phongbench.targets.target import UNITS

#: this machine, whose costs are the times of a run
CPU = "cpu"
#: what a row says of its cost besides: in which unit, of which kind, and what limits the program
COLUMNS = ["target", "cost", "unit", "cost_kind", "bound_by"]
#: the column that decides between formulas which take equally much of a scarce unit: their cost where none is
TIE = "cost_alone"


def checked(target: str, short_of: str | None) -> str:
    """The target; UnknownNameError for a name that is none, InputError for a unit that is none or not known of it."""
    if target not in (CPU, *TARGETS):
        raise UnknownNameError("target", target, (CPU, *TARGETS), "target")
    if short_of not in (None, *UNITS):
        raise UnknownNameError("unit", short_of, UNITS, "short_of")
    if short_of is not None and target == CPU:
        raise InputError("only a compiled target tells what its units do", "short_of", "name a target, e.g. rdna2")
    return target


def priced(
    cells: pd.DataFrame, alphas: Iterable[float], target: str, short_of: str | None, notes: list[str]
) -> pd.DataFrame:
    """The cells whose cost on the target is known, with columns ns (missing), ratio, its ends, COLUMNS and TIE.

    cells     rows of CELL and any others; what they say of time is replaced
    alphas    the cost is the largest over these exponents
    short_of  issue or special: the unit that counts; None for none in particular
    notes     receives how many formulas are left out
    Raises InputError for another precision than float32, and what `checked` and `shipped` raise.
    """
    if set(cells["precision"].astype(str)) - {"float32"}:
        raise InputError(f"costs on {target} are those of float32 code", "precision", "leave the precision out")
    table, every = shipped(target), tuple(alphas)
    rows = [{str(name): value for name, value in row.items()} for row in cells.to_dict("records")]
    found = [_worst(table, row, every, short_of) for row in rows]
    known = pd.Series([cost is not None for cost in found], index=cells.index, dtype=bool)
    if not known.all():
        names = sorted({str(name) for name in cells.loc[~known, "approximation"]})
        notes.append(f"left out, since no cost of their code on {target} is shipped: {', '.join(names)}")
    kept = cells[known].reset_index(drop=True)
    costs = [cost for cost in found if cost is not None]
    ratio = [table.ratio(cost, short_of) for cost in costs]
    return kept.assign(
        ns=float("nan"),
        ratio=ratio,
        ratio_low=ratio,
        ratio_high=ratio,
        target=target,
        cost=[cost.short_of(short_of) for cost in costs],
        **{TIE: [cost.cost for cost in costs]},
        unit=table.target.unit,
        cost_kind="compiled",
        bound_by=[short_of or cost.bound_by for cost in costs],
    )


def _worst(table: CostTable, row: Mapping[str, Any], alphas: tuple[float, ...], short_of: str | None) -> Cost | None:
    """A cell's largest cost over exponents; None where one is not in the table."""
    formula = Formula.of_row(row)
    if formula.approximation not in REGISTRY:
        return None
    codes = [_code(formula, alpha, table.target.language) for alpha in alphas]
    costs = [None if one is None else table.known(one) for one in codes]
    return None if None in costs else max((c for c in costs if c is not None), key=lambda c: c.short_of(short_of))


@lru_cache(maxsize=1 << 14)
def _code(formula: Formula, alpha: float, language: str) -> Code | None:
    """The formula's code; None for an exponent that it does not take."""
    with suppress(InputError):
        return code(formula, alpha, language)
    return None


def same_cost(cells: pd.DataFrame) -> pd.Series:
    """A number for each cell, equal for those whose costs are the same: of counted costs, or of one timed kernel."""
    by = ["cost"] if "cost" in cells else KERNEL
    return cells.groupby(by, dropna=False, observed=True, sort=True).ngroup()
