"""A document of `phongbench bench`, made up."""

from typing import Any

from phongbench.benchmarks.bounds import BYTES, PORTS, ROOTS, VECTORS

_RATIO = {"ratio": 2.9, "ratio_low": 2.8, "ratio_high": 3.0}
_PEER = {"by": "numpy", "version": "2", "ns": 1.9, "cores": 1.0, "error": 4e-6, "verdict": "slower"}
_LIMITS = {"bound": 0.2, "over_bound": 1.8, "bound_by": BYTES, "multiply_adds": 24.0, "roots": 1.0, "bytes": 28.0}
#: without the peers that were named
BENCH: dict[str, Any] = {
    "rows": [{"work": "exact Phong", "working_set": "l2", "elements": 37504, **_PEER, **_RATIO}],
    "bounds": [{"work": "exact Phong", "working_set": "l2", "ns": 0.36, "vectors": 40.0, "lanes": 16, **_LIMITS}],
    "ours": [{"part": "kernel", "name": "exact Phong", "place": "l2", "ns": 0.36, "rounds": 24, **_RATIO}],
    "ceilings": {"l2": {PORTS: 4.0, VECTORS: 4.0, ROOTS: 1.0, BYTES: 150.0}, "memory": {}},
    "calls": [
        {"part": part, "name": name, "place": "640x360", "seconds": 0.05, "rounds": 8, **_RATIO, **_LIMITS}
        for part, name in (("shading", "shade, 8 lights"), ("scene", "picture of many-lights"))
    ],
    "stages": [
        {"part": "stage", "name": name, "place": "quick, warm", "seconds": 9.0, "rounds": 1, "peak_mib": None}
        | dict.fromkeys(("ratio_low", "ratio_high"))
        | {"ratio": 40.0}
        for name in ("accuracy", "the whole command")
    ],
    "absent": {"torch": "not installed"},
    "notes": ["8 rounds only"],
    "subnormals": [],
    "sweep": {"evaluations_per_second": 5e8, "numpy_evaluations_per_second": 1e7, "rounds": 8}
    | {"ratio": 50.0, "ratio_low": 49.0, "ratio_high": 51.0},
}
