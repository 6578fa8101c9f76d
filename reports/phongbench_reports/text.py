"""Numbers and cells as words: one way to write each, used by figures, tables and captions alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Error budgets: one code of an 8-bit and of a 10-bit display channel.
BUDGETS = ((1 / 255, "1/255"), (1 / 1023, "1/1023"))


def missing(value: Any) -> bool:
    """True for None, NaN and pandas' NA."""
    return value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value))


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows as dictionaries, column name to value."""
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


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


def percent(value: float) -> str:
    """A signed fraction as percent: "+1 %", "−0.0175 %", "0 %"."""
    sign = "−" if value < 0 else "+" if value > 0 else ""
    return f"{sign}{abs(100 * value):.3g}\u00a0%"


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


def label(cell: Mapping[str, Any] | pd.Series) -> str:
    """Short name of a cell: "lyon · cross · γ8 · minimax"; Taylor slopes and reflect space go without saying."""
    parts = [str(cell["approximation"])]
    if cell["lambda_form"] != "none":
        parts.append(str(cell["lambda_form"]))
    if not missing(cell["gamma"]):
        parts.append(f"γ{int(cell['gamma'])}")
    if cell.get("beta_policy", "none") not in ("taylor", "none"):
        parts.append(str(cell["beta_policy"]))
    if cell.get("space", "reflect") != "reflect":
        parts.append(str(cell["space"]))
    return " · ".join(parts)


def span(values: Iterable[Any]) -> str:
    """Smallest and largest of some counts: "131 072" or "4 096 to 131 072"."""
    found = sorted({int(value) for value in values})
    if not found:
        return "no"
    return number(found[0]) if len(found) == 1 else f"{number(found[0])} to {number(found[-1])}"


def listed(words: Iterable[str]) -> str:
    """Words as a sentence part: "a", "a and b", "a, b and c"."""
    parts = list(words)
    return " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]])) if parts else "none"


def basis(rows: pd.DataFrame) -> str:
    """What accuracy rows rest on: "131 072 samples a cell, coverage: sampled"."""
    return f"{span(rows['samples'])} samples a cell, coverage: {listed(sorted(set(rows['coverage'].astype(str))))}"
