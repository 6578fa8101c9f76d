"""A formula over the angle: as numbers, as a table, or drawn."""

import csv
import io
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request
from numpy.typing import NDArray
from starlette.responses import Response

from phongbench.compiler.precisions import precision_named
from phongbench_api.formula_answers import CURVE, LYON
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.models import CurveParameters
from phongbench_api.service import Service, service
from phongbench_api.work import evaluation

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (media.JSON, media.CSV, media.SVG)
COLUMNS = ("angle_degrees", "value", "exact", "error")
#: predicted seconds of drawing; the first picture also imports what draws
DRAWING = 0.5


@router.get(
    "/curve",
    summary="Value and error against the angle",
    **described(CURVE, 406, 413, 422, 503, also=(media.CSV, media.SVG), ask=f"/v1/curve?{LYON}&points=7"),
)
async def curve(request: Request, parameters: Annotated[CurveParameters, Query()]) -> Response:
    """The lobe of a formula, exact Phong's, and their difference, over the angle between R and V."""
    spans, here = media.Spans(), service(request)
    media_type = media.negotiate(request.headers.get("accept"), FAMILY)
    cost, work = _work(here, parameters, media_type)
    spans.mark("parse")
    return await here.admission.run(request, cost, work, partial(_answer, media_type), spans)


def _work(here: Service, parameters: CurveParameters, media_type: str) -> tuple[float, Callable[[Any], Any]]:
    """Predicted seconds, and the work: numbers, or the drawn SVG."""
    lobe, precision = evaluation.requested(parameters), precision_named(parameters.precision)
    cost = here.kernels.curve_cost(lobe, parameters.points, precision)

    def numbers(_cancelled: Any) -> Any:
        here.kernels.compile_curve(lobe, precision)
        return evaluation.curve(lobe, _angles(parameters), precision, parameters.perturbation, parameters.length_error)

    def drawn(cancelled: Any) -> bytes:
        from phongbench_reports.figures.lobe import svg  # late: it brings matplotlib

        return svg(str(lobe.formula), lobe.alpha, numbers(cancelled))

    return (cost + DRAWING, drawn) if media_type == media.SVG else (cost, numbers)


def _angles(parameters: CurveParameters) -> NDArray[np.float64]:
    if parameters.spacing == "square":
        return parameters.degrees * np.linspace(0.0, 1.0, parameters.points) ** 2
    return np.linspace(0.0, parameters.degrees, parameters.points)


def _answer(media_type: str, curve: Any, spans: media.Spans) -> Response:
    if media_type == media.JSON:
        return media.json(curve, spans)
    return media.response(curve if media_type == media.SVG else _csv(curve), media_type, spans)


def _csv(curve: dict[str, Any]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(zip(*(curve[name].tolist() for name in COLUMNS), strict=True))
    return out.getvalue()
