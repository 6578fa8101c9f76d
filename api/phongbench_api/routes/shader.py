"""A formula as source text."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench.compiler.precisions import FLOAT32
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code import export
from phongbench_api.http import media as wire
from phongbench_api.http.openapi import described
from phongbench_api.models import ShaderAsk
from phongbench_api.service import service
from phongbench_api.work import evaluation

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (wire.TEXT, wire.JSON)
EXAMPLE = {"language": "glsl", "text": "float highlight(vec3 r, vec3 v) { .. }", "max_error": 0.0299}
#: predicted seconds of writing one and looking for its largest error
SECONDS = 0.01


@router.get(
    "/shader", summary="A formula as GLSL, HLSL, WGSL or C", **described(EXAMPLE, 406, 422, 503, also=(wire.TEXT,))
)
async def shader(request: Request, ask: Annotated[ShaderAsk, Query()]) -> Response:
    """The source of a function of two directions, in float32, with its constants filled in."""
    spans = wire.Spans()
    media = wire.negotiate(request.headers.get("accept"), FAMILY)
    formula, here = evaluation.asked(ask), service(request)
    spans.mark("parse")

    def work(_gone: object) -> export.Shader:
        here.kernels.compile_curve(formula, FLOAT32)
        s = formula.setting
        named = Formula(formula.spec.name, formula.form, s.gamma, s.slope, s.space)
        return export.shader(named, s.alpha, ask.language)

    cost = SECONDS + here.kernels.curve_cost(formula, export.ANGLES, FLOAT32)
    return await here.office.do(request, cost, work, partial(_answer, media), spans)


def _answer(media: str, found: export.Shader, spans: wire.Spans) -> Response:
    if media == wire.JSON:
        return wire.json(found.as_dict(), spans)
    spans.mark("encode")
    return Response(found.text, headers=spans.header(), media_type=media)
