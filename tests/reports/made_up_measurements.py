"""What long measurements of `make docs` would give, made up, and how their tables are read."""

from __future__ import annotations

from typing import Any

from phongbench.benchmarks.false_alarms import Alarms
from phongbench.benchmarks.study_bench import Wall

RATES = {"evaluations_per_second": 5.1e8, "numpy_evaluations_per_second": 1.05e7, "ratio": 48.57}


def timed(by: str, work: str, ratio: float, verdict: str) -> dict[str, Any]:
    return {
        "by": by,
        "version": "1.2",
        "work": work,
        "working_set": "l2",
        "ns": 0.35,
        "ratio": ratio,
        "ratio_low": ratio - 0.1,
        "ratio_high": ratio + 0.1,
        "verdict": verdict,
        "rounds": 24,
    }


def drawn(tracer: str, seconds: float, **what: Any) -> dict[str, Any]:
    return {
        "tracer": tracer,
        "version": "1.2",
        "draws": "depth 3, shadows",
        "size": "64x36",
        "seconds": seconds,
        "mpixels_per_second": 0.002304 / seconds,
        "mrays_per_second": None,
        "pixels_off": 0.0,
        "surfaces_agree": None,
        "note": f"what {tracer} does",
        **what,
    }


COMPARED = {
    "alpha": 50.0,
    "gamma": 8,
    "absent": {"jax": "not installed"},
    "sweep": RATES,
    "rows": [timed("phongbench", "exact Phong", 1.0, "baseline"), timed("numpy", "exact Phong", 4.8, "slower")],
}


ALARMS = [Alarms("l1", 200, 24, 1, 3, 0.0138, 12.0)]


PICTURES = {
    "skips": {
        "many-lights": [
            {"variant": v, "seconds": 0.1, "ratio": r, "same_bits": v != "all", "largest_change": c}
            for v, r, c in (("all", 1.0, 0.02), ("exact", 2.0, 0.0), ("none", 5.0, 0.0))
        ]
    },
    "tracers": [
        drawn("phongbench", 0.01, mrays_per_second=20.0, ratio=1.0),
        drawn("plain NumPy", 0.25, mrays_per_second=0.8, ratio=25.0, pixels_off=0.001),
        drawn("mitsuba", 0.02, ratio=2.0, pixels_off=0.002, surfaces_agree=0.99999),
    ],
    "absent": [{"tracer": "pyvista", "why": "not installed; pip install pyvista brings it"}],
}


DOCUMENT = {"cells": 5000, "evaluations": 23_456_000_000, "seconds": {"accuracy": 30.04, "timing": 8, "report": 2.5}}


WALLS = [Wall("cold", DOCUMENT, 45.04), Wall("warm", DOCUMENT, 25.0)]


def lines_of(part: str) -> list[list[str]]:
    """The cells of a Markdown table, headings and rule first."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines() if line[:1] == "|"]
