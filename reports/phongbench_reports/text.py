"""Numbers and cells as words: one way to write each, used by figures, tables and captions alike."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from phongbench.analysis.front import natives
from phongbench.analysis.rows import Rows
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import SPACES
from phongbench.timing.statistics import LEVEL

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Error budgets: one code of an 8-bit and of a 10-bit display channel.
BUDGETS = ((1 / 255, "1/255"), (1 / 1023, "1/1023"))

#: how every interval of a ratio of times is called
INTERVAL = f"{100 * LEVEL:g}\u00a0% interval"


def missing(value: Any) -> bool:
    """True for None, NaN and pandas' NA."""
    return value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value))


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows as dictionaries, column name to value."""
    columns = {str(name): natives(frame[name]) for name in frame.columns}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def number(value: Any, digits: int = 3) -> str:
    """A number with `digits` significant digits: 0.0299, 1.7×10⁻⁵, 131 072, "not finite", or a dash."""
    if missing(value):
        return "–"
    value = float(value)
    if not math.isfinite(value):
        return "not finite"
    if value == 0.0:
        return "0"
    if value == int(value) and abs(value) < 1e12:
        return f"{int(value):,}".replace(",", "\u202f")
    if abs(value) < 1e-3 or abs(value) >= 1e6:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        return f"{mantissa}×10{str(int(exponent)).translate(SUPERSCRIPT)}"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{decimals}f}".replace(",", "\u202f")


def counted(count: int, noun: str) -> str:
    """A count and what it counts: "1 exponent", "12 exponents"."""
    return f"{number(count)} {noun}{'s' * (count != 1)}"


def percent(value: float) -> str:
    """A signed fraction as percent: "+1 %", "−0.0175 %", "0 %"."""
    sign = "−" if value < 0 else "+" if value > 0 else ""
    return f"{sign}{abs(100 * value):.3g}\u00a0%"


def share(part: float, digits: int = 3) -> str:
    """A part of the whole as percent: "12.5 %"."""
    return f"{100 * part:.{digits}g}\u00a0%"


def power_of_ten(value: float, _position: int = 0) -> str:
    """Label of a decade on a log axis, as plain text: 0.001 to 1000 in full, else 10⁻⁵."""
    if value <= 0:
        return ""
    exponent = round(math.log10(value))
    if abs(value / 10.0**exponent - 1.0) > 1e-6:
        return ""
    if -3 <= exponent <= 3:
        return f"{10.0**exponent:g}"
    return "10" + str(exponent).translate(SUPERSCRIPT)


def label(row: Mapping[str, Any] | pd.Series) -> str:
    """The spelling of a row's formula, "lyon:cross:8:minimax"; columns that the row lacks count as unsaid."""
    spec = REGISTRY.get(str(row["approximation"]))
    space = spec.spaces[0] if spec else SPACES[0]
    unsaid = {"lambda_form": "none", "gamma": None, "beta_policy": "none", "space": space}
    return str(Formula.of_row(unsaid | dict(row)))


def alpha_is(alpha: Any) -> str:
    """ "α = 50", which no line end tears apart."""
    return f"α\u00a0=\u00a0{alpha:g}"


def gamma_is(gamma: Any) -> str:
    """ "γ = 8", which no line end tears apart."""
    return f"γ\u00a0=\u00a0{int(gamma)}"


def interval(low: float, high: float) -> str:
    """Both ends: "0.981 to 1.02"."""
    return f"{number(low)} to {number(high)}"


def ratio(row: Mapping[str, Any]) -> str:
    """A row's ratio with its interval: "0.500 (0.450 to 0.550)"; a dash where there is none."""
    if missing(row["ratio"]):
        return "–"
    return f"{number(row['ratio'])} ({interval(row['ratio_low'], row['ratio_high'])})"


def span(values: Iterable[Any]) -> str:
    """Smallest and largest of some counts: "131 072" or "4 096 to 131 072"."""
    counts = sorted({int(value) for value in values})
    if not counts:
        return "no"
    return number(counts[0]) if len(counts) == 1 else interval(counts[0], counts[-1])


def listed(words: Iterable[str]) -> str:
    """Words as a sentence part: "a", "a and b", "a, b and c"."""
    parts = list(words)
    return " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]])) if parts else "none"


def basis(rows: pd.DataFrame) -> str:
    """What accuracy rows rest on: "131 072 samples a cell, coverage: sampled"."""
    return f"{span(rows['samples'])} samples a cell, coverage: {listed(sorted(set(rows['coverage'].astype(str))))}"


def time_it(study: Rows) -> str:
    """What gives a run without times its times."""
    return "Finish the run: it goes on with --resume." if study.awaits_timing else "Run again without --no-timing."
