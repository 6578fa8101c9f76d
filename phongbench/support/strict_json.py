"""Data as JSON can hold it, where numbers may not be finite."""

import math
from typing import Any

import numpy as np


def strict(data: Any) -> Any:
    """The data with "NaN", "Infinity" and "-Infinity" for what JSON has no number for; encoders write null or fail."""
    if isinstance(data, float | np.floating):
        return float(data) if math.isfinite(data) else _word(float(data))
    if isinstance(data, np.ndarray):
        floating = data.dtype.kind == "f"
        return data if not floating or np.isfinite(data).all() else strict(data.tolist())
    if isinstance(data, dict):
        return {str(key): strict(value) for key, value in data.items()}
    return [strict(value) for value in data] if isinstance(data, list | tuple) else data


def _word(value: float) -> str:
    return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
