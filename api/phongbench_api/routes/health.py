"""Is the server there, is it ready, and what is it?"""

from dataclasses import asdict
from functools import cache
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from phongbench import __version__
from phongbench.compiler.lowering import PRECISIONS
from phongbench.formulas.shader_code.export import LANGUAGES
from phongbench.inputs.mtl_files import OPENGL
from phongbench.inputs.optical_constants import EXACT
from phongbench.results.provenance import versions
from phongbench_api.answers import META
from phongbench_api.http import arrays, media
from phongbench_api.http.openapi import described
from phongbench_api.http.problems import BusyError
from phongbench_api.http.shapes import answer
from phongbench_api.service import service
from phongbench_api.settings import Settings

router = APIRouter(tags=["server"])
_OK = answer({"status": "ok"})
_LIMITS = (
    "max_body", "max_json", "max_points", "max_json_points", "max_lights", "max_pixels", "max_scene", "max_triangles",
    "max_rows", "max_cost", "max_wait", "read_seconds",
)  # fmt: skip


@router.get("/healthz", summary="Is the server there?", **described(_OK))
async def healthz() -> Response:
    """Answers as long as the process runs, however busy the cores are."""
    return media.json({"status": "ok"})


@router.get("/readyz", summary="May requests be sent here?", **described(_OK, 503))
async def readyz(request: Request) -> Response:
    """503 until the kernels are warm, and again while the server goes down."""
    admission = service(request).admission
    if not admission.open or admission.draining:
        raise BusyError("not ready", headers={"retry-after": "1"})
    return media.json({"status": "ok"})


@router.get("/v1/meta", summary="Versions, limits, media types", **described(META))
async def meta(request: Request) -> Response:
    """What this server is, what it reads and writes, and how much of it."""
    return media.json(_meta(service(request).settings))


@cache
def _reflectances() -> dict[str, list[list[float]]]:
    """What each material with known optical constants mirrors of red, green and blue, at V.H = 0, 1/128, .. 1."""
    return {
        name: [[float(exact.bound(channel)(i / 128)) for channel in range(3)] for i in range(129)]
        for name, exact in EXACT.items()
    }


def _meta(settings: Settings) -> dict[str, Any]:
    values = asdict(settings)
    return {
        "name": "phongbench",
        "version": __version__,
        "versions": asdict(versions()),
        "precisions": list(PRECISIONS),
        "materials": [asdict(material) for material in OPENGL],
        "reflectances": _reflectances(),
        "dtypes": list(arrays.DTYPES),
        "languages": {name: [one.precision, *one.precisions] for name, one in LANGUAGES.items()},
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
