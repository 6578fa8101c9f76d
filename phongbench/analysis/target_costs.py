"""What formulas cost on another target than this machine, beside their errors.

On a compiled one costs are counted from machine code, without an interval; on one that was measured elsewhere and added
they are times, with one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.results.records import Records, Row, key
from phongbench.results.runs import DEFAULT_ROOT
from phongbench.results.schema import CELL, CPU, GPU, KERNEL, NO_FORMULAS
from phongbench.targets import measured
from phongbench.targets.chips import TARGETS
from phongbench.targets.code_shapes import Code, shipped_code
from phongbench.targets.costs import CostTable, shipped
from phongbench.targets.measured import MeasuredTable, Shelf
from phongbench.targets.target import UNITS

#: in which code of the adapter is compared with another's
_WRITTEN = "wgsl"
#: what a row says of its cost besides: in which unit, of which kind, and what limits the program
COLUMNS = ["target", "cost", "unit", "cost_kind", "bound_by"]
#: the column that decides between formulas which take equally much of a scarce unit: their cost where none is
TIE = "cost_alone"
#: what a run's costs say of a formula
_PRICED = [*CELL, "cost", "ratio", "ratio_low", "ratio_high"]


@dataclass(frozen=True, slots=True)
class Price:
    """What a formula costs on a target.

    cost        in the target's unit; of the scarce unit alone, if one is
    alone       the same where no unit is scarce
    ratio, low, high   to exact Phong, with the ends of the interval
    bound_by    the unit that limits, None where a time was measured
    alpha       the exponent that the price is of, where another one's code may be another; None where it holds for all
    """

    cost: float
    alone: float
    ratio: float
    low: float
    high: float
    bound_by: str | None
    alpha: float | None = None


def checked(target: str, short_of: str | None, root: Shelf = DEFAULT_ROOT) -> str:
    """The target; UnknownNameError for a name that is none, InputError for a unit that is none or not known of it.

    root  the folder of the runs, in which targets were added, or the measurement of the one that is meant
    """
    if target not in (CPU, GPU, *TARGETS) and target not in (here := measured.names(root)):
        raise UnknownNameError("target", target, (CPU, GPU, *TARGETS, *here), "target")
    if short_of not in (None, *UNITS):
        raise UnknownNameError("unit", short_of, UNITS, "short_of")
    if short_of is not None and target not in TARGETS:
        raise InputError("only a compiled target tells what its units do", "short_of", "name a target, e.g. rdna2")
    if short_of is not None and not shipped(target).baseline.short_of(short_of):
        what = f"exact Phong needs nothing of a {short_of} unit on {target}, so no cost stands beside it there"
        raise InputError(what, "short_of", "leave it out, or name a GPU, e.g. rdna2")
    return target


def unit_of(target: str, root: Shelf = DEFAULT_ROOT) -> dict[str, str]:
    """What costs on a target are: `unit` and `cost_kind`."""
    if target in TARGETS:
        return {"unit": TARGETS[target].unit, "cost_kind": "compiled"}
    unit = measured.UNIT if target in (CPU, GPU) else measured.added(target, root).unit
    return {"unit": unit, "cost_kind": "measured"}


def own_prices(
    costs: Records | None, target: str, short_of: str | None, precision: str = FLOAT32, notes: list[str] | None = None
) -> dict[Formula, Price]:
    """What a run's costs say of formulas that do not ship, which were compiled with it; nothing of a scarce unit.

    Of GPU, which was measured with it, what they say of every formula; InputError where it was not.
    precision  of their code
    notes      receives what was measured on, and how
    """
    if target == GPU:
        return _gpu_prices(costs, notes if notes is not None else [])
    if costs is None or short_of is not None or not (own := _own_names(costs)):
        return {}
    rows = costs.at(target=target, context=0, precision=precision, approximation=own).rows([*_PRICED, "bound_by"])
    return {Formula.of_row(row): _stored(row, row["bound_by"], None) for row in rows}


def _own_names(costs: Records) -> tuple[str, ...]:
    """The formulas among a run's costs that do not ship."""
    return tuple(name for name in costs.distinct("approximation") if name not in REGISTRY) if len(costs) else ()


def _stored(row: Row, bound_by: str | None, alpha: float | None) -> Price:
    return Price(row["cost"], row["cost"], row["ratio"], row["ratio_low"], row["ratio_high"], bound_by, alpha)


def _gpu_prices(costs: Records | None, notes: list[str]) -> dict[Formula, Price]:
    """The prices of formulas whose times have an interval."""
    rows = None if costs is None or not len(costs) else costs.at(target=GPU)
    if rows is None or not len(rows):
        raise InputError("the run has no times of an adapter", "target", "measure one: phongbench run --target gpu")
    notes.append(f"gpu: {rows.rows(['tool'])[0]['tool']}")
    bare = rows.at(context=0, reads=0).rows([*_PRICED, "alpha"])
    named = [row for row in bare if row["approximation"] not in NO_FORMULAS]
    whole = [row for row in named if row["ratio_low"] is not None and row["ratio_high"] is not None]
    if not whole:
        fix = "measure again while nothing else runs: phongbench run --target gpu"
        raise InputError("the run's times of the adapter are too few for intervals", "target", fix)
    return {Formula.of_row(row): _stored(row, None, row["alpha"]) for row in whole}


def priced(
    cells: Sequence[Row],
    alphas: Iterable[float],
    target: str,
    short_of: str | None,
    notes: list[str],
    root: Shelf = DEFAULT_ROOT,
    own: Mapping[Formula, Price] = MappingProxyType({}),
) -> list[Row]:
    """The cells whose cost on the target is known, with columns ns (of a time), ratio, its ends, COLUMNS and TIE.

    cells     rows of CELL in one precision, and any others; what they say of time is replaced
    alphas    the cost is the largest over these exponents
    short_of  issue or special: the unit that counts; None for none in particular
    notes     receives which formulas are left out
    root      the folder of the runs, in which targets were added
    own       prices of formulas that no table knows
    Raises InputError for a precision that no costs on the target are of, and what `checked` and `shipped` raise.
    """
    precision = next((str(row["precision"]) for row in cells), FLOAT32)
    table, every = table_of(target, root, precision), tuple(alphas)
    found = prices([Formula.of_row(row) for row in cells], every, table, short_of, own)
    if unknown := {str(row["approximation"]) for row, price in zip(cells, found, strict=True) if price is None}:
        notes.append(f"left out, since no cost of their code on {target} is known: {', '.join(sorted(unknown))}")
    timed = isinstance(table, MeasuredTable)
    kind = {"unit": table.unit, "cost_kind": "measured" if timed else "compiled"}
    return [
        {
            **row,
            "ns": price.cost if timed else None,
            "ratio": price.ratio,
            "ratio_low": price.low,
            "ratio_high": price.high,
            "target": target,
            "cost": price.cost,
            TIE: price.alone,
            **kind,
            "bound_by": price.bound_by,
        }
        for row, price in zip(cells, found, strict=True)
        if price is not None
    ]


def table_of(target: str, root: Shelf = DEFAULT_ROOT, precision: str = FLOAT32) -> CostTable | MeasuredTable:
    """The costs that are known of a target other than cpu, of code in a precision; of gpu none but a run's own.

    Raises InputError for a precision that none are of.
    """
    if target in TARGETS:
        return shipped(target, precision)
    nothing = MeasuredTable(GPU, "", "WebGPU", "", measured.Timed(1.0, 1.0, 1.0), {})
    table = nothing if target == GPU else measured.added(target, root)
    if precision != table.precision:
        raise InputError(f"costs on {target} are those of {table.precision} code", "precision", "leave it out")
    return table


def prices(
    formulas: Iterable[Formula],
    alphas: tuple[float, ...],
    table: CostTable | MeasuredTable,
    short_of: str | None = None,
    own: Mapping[Formula, Price] = MappingProxyType({}),
) -> list[Price | None]:
    """Each formula's largest price over exponents; None where the table does not know one, nor `own`."""
    return [_own(own, formula, alphas) or _worst(table, formula, alphas, short_of) for formula in formulas]


def _own(own: Mapping[Formula, Price], formula: Formula, alphas: tuple[float, ...]) -> Price | None:
    """The price that a run itself has, if its code is that of all these exponents but for numbers."""
    price = own.get(formula)
    if price is None or price.alpha is None or formula.approximation not in REGISTRY:
        return price
    codes = [shipped_code(formula, alpha, _WRITTEN) for alpha in (price.alpha, *alphas)]
    return price if len({None if one is None else one.shape for one in codes}) == 1 else None


def _worst(
    table: CostTable | MeasuredTable, formula: Formula, alphas: tuple[float, ...], short_of: str | None
) -> Price | None:
    """A formula's largest price over exponents; None where one is not in the table."""
    if formula.approximation not in REGISTRY:
        return None
    codes = [shipped_code(formula, alpha, table.language, table.precision) for alpha in alphas]
    each = [None if one is None else _price(table, one, short_of) for one in codes]
    return None if None in each else max((price for price in each if price is not None), key=lambda price: price.cost)


def _price(table: CostTable | MeasuredTable, one: Code, short_of: str | None) -> Price | None:
    if isinstance(table, MeasuredTable):
        timed = table.known(one)
        return None if timed is None else Price(timed.cost, timed.cost, *table.ratios(timed), None)
    if (cost := table.known(one)) is None:
        return None
    ratio = table.ratio(cost, short_of)
    return Price(cost.short_of(short_of), cost.cost, ratio, ratio, ratio, short_of or cost.bound_by)


def same_cost(cells: Sequence[Row]) -> list[int]:
    """A number for each cell, equal for those whose costs are the same: of counted costs, or of one timed kernel."""
    counted = bool(cells) and all(row.get("cost_kind") == "compiled" for row in cells)
    numbers: dict[tuple[Any, ...], int] = {}
    return [numbers.setdefault(one, len(numbers)) for one in map(key(["cost"] if counted else KERNEL), cells)]
