"""A curve as numbers, as a table, or drawn."""

import csv
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.responses import Response

from phongbench.compiler.precisions import precision_named
from phongbench_api.http import media as wire
from phongbench_api.models import CurveAsk
from phongbench_api.service import Service
from phongbench_api.work import evaluation

FAMILY = (wire.JSON, wire.CSV, wire.SVG)
COLUMNS = ("angle_degrees", "value", "exact", "error")
EXAMPLE: dict[str, Any] = {name: [0.0] for name in COLUMNS} | {
    "max_abs_error": 0.0,
    "worst_index": 0,
    "beta": 6.25,
    "cutoff_degrees": 34.0,
}
#: predicted seconds of drawing; the first picture also imports what draws
DRAWING = 0.5


def plan(service: Service, ask: CurveAsk, media: str) -> tuple[float, Callable[[Any], Any]]:
    """Predicted seconds, and the work: numbers, or the drawn SVG."""
    formula = evaluation.asked(ask)
    precision = precision_named(ask.precision)
    cost = service.kernels.curve_cost(formula, ask.points, precision)

    def numbers(_gone: Any) -> Any:
        service.kernels.compile_curve(formula, precision)
        return evaluation.curve(formula, _angles(ask), precision, ask.perturbation, ask.length_error)

    def drawn(gone: Any) -> bytes:
        from phongbench_reports.figures.lobe import svg  # late: it brings matplotlib

        return svg(evaluation.name_of(formula), formula.setting.alpha, numbers(gone))

    return (cost + DRAWING, drawn) if media == wire.SVG else (cost, numbers)


def _angles(ask: CurveAsk) -> NDArray[np.float64]:
    if ask.spacing == "square":
        return ask.degrees * np.linspace(0.0, 1.0, ask.points) ** 2
    return np.linspace(0.0, ask.degrees, ask.points)


def answer(media: str, found: Any, spans: wire.Spans) -> Response:
    """The curve in the media type asked for."""
    if media == wire.JSON:
        return wire.json(found, spans)
    body = found if media == wire.SVG else _csv(found)
    spans.mark("encode")
    return Response(body, headers=spans.header(), media_type=media)


def _csv(found: dict[str, Any]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(zip(*(found[name].tolist() for name in COLUMNS), strict=True))
    return out.getvalue()
