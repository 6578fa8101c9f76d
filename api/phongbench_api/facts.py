"""What a server tells about itself."""

from dataclasses import asdict
from typing import Any

from phongbench import __version__
from phongbench.lowering import PRECISIONS
from phongbench.materials import OPENGL
from phongbench.provenance import versions
from phongbench_api import wire
from phongbench_api.settings import Settings

_LIMITS = (
    "max_body",
    "max_json",
    "max_points",
    "max_json_points",
    "max_lights",
    "max_pixels",
    "max_scene",
    "max_triangles",
    "max_rows",
    "max_cost",
    "max_wait",
    "read_seconds",
)
EXAMPLE = {"name": "phongbench", "version": __version__}


def meta(settings: Settings) -> dict[str, Any]:
    """Versions, precisions, limits, media types."""
    values = asdict(settings)
    return {
        **EXAMPLE,
        "versions": asdict(versions()),
        "precisions": list(PRECISIONS),
        "materials": [asdict(material) for material in OPENGL],
        "dtypes": list(wire.DTYPES),
        "limits": {name: values[name] for name in _LIMITS},
        "cores": settings.cores,
        "media_types": {
            "specular": {"in": [wire.JSON, wire.OCTETS, wire.NPY], "out": [wire.JSON, wire.OCTETS, wire.NPY]},
            "shade": {"in": [wire.JSON, wire.MULTIPART], "out": [wire.JSON, wire.NPY, wire.OCTETS]},
            "render": {"in": [wire.JSON], "out": [wire.PNG, wire.JSON, wire.NPY]},
            "curve": {"out": [wire.JSON, wire.CSV, wire.SVG]},
            "rows": {"out": [wire.JSON, wire.CSV, wire.PARQUET]},
        },
    }
