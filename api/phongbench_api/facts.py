"""What a server tells about itself."""

from dataclasses import asdict
from typing import Any

from phongbench import __version__
from phongbench.compiler.lowering import PRECISIONS
from phongbench.inputs.mtl_files import OPENGL
from phongbench.results.provenance import versions
from phongbench_api.http import media
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
        "dtypes": list(media.DTYPES),
        "limits": {name: values[name] for name in _LIMITS},
        "cores": settings.cores,
        "media_types": {
            "specular": {"in": [media.JSON, media.OCTETS, media.NPY], "out": [media.JSON, media.OCTETS, media.NPY]},
            "shade": {"in": [media.JSON, media.MULTIPART], "out": [media.JSON, media.NPY, media.OCTETS]},
            "render": {"in": [media.JSON], "out": [media.PNG, media.JSON, media.NPY]},
            "curve": {"out": [media.JSON, media.CSV, media.SVG]},
            "rows": {"out": [media.JSON, media.CSV, media.PARQUET]},
        },
    }
