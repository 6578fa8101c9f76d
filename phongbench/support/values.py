"""Values of documents that people write: three numbers, a colour, a direction; each error names the field."""

import math
from typing import Any

from phongbench.errors import InputError

Vector3 = tuple[float, float, float]
RGB = tuple[float, float, float]


def three(value: Any, where: str) -> Vector3:
    """Three finite numbers; InputError naming the field otherwise."""
    try:
        x, y, z = value
        found = (float(x), float(y), float(z))
    except (TypeError, ValueError, OverflowError):
        raise InputError("not three numbers", where, "give [x, y, z]") from None
    if isinstance(value, str) or not all(map(math.isfinite, found)):
        raise InputError("not three finite numbers", where, "give [x, y, z]")
    return found


def colour(value: Any, where: str) -> RGB:
    """Three finite numbers >= 0, red, green and blue; they may exceed 1. InputError naming the field otherwise."""
    found = three(value, where)
    if min(found) < 0:
        raise InputError("a colour cannot be negative", where, "give three numbers from 0 up")
    return found


def number(value: Any, where: str, low: float = 0.0) -> float:
    """One finite number of at least `low`; InputError naming the field otherwise."""
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not a number", where) from None
    if isinstance(value, str) or not math.isfinite(found) or found < low:
        raise InputError(f"not a finite number of at least {low:g}", where)
    return found


def direction(value: Any, where: str) -> Vector3:
    """Three finite numbers, not all 0; the length does not matter, here it becomes 1. InputError naming the field."""
    found = three(value, where)
    largest = max(map(abs, found))
    if largest == 0:
        raise InputError("a direction cannot be 0", where, "give the vector from the surface towards it")
    x, y, z = (v / largest for v in found)  # neither overflows nor vanishes when squared
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)
