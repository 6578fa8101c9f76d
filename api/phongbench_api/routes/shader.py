"""A formula as source text."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench.analysis.promises import bound_at
from phongbench.compiler.precisions import FLOAT32
from phongbench.formulas.shader_code import export
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.models import ShaderParameters
from phongbench_api.service import service
from phongbench_api.work import evaluation

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (media.TEXT, media.JSON)
EXAMPLE = {"language": "glsl", "text": "float highlight(vec3 r, vec3 v) { .. }", "max_error": 0.0299, "bound": 0.0303}
#: predicted seconds of writing one, of looking for its largest error, and of proving a bound
SECONDS = 0.1


@router.get(
    "/shader", summary="A formula as GLSL, HLSL, WGSL or C", **described(EXAMPLE, 406, 422, 503, also=(media.TEXT,))
)
async def shader(request: Request, parameters: Annotated[ShaderParameters, Query()]) -> Response:
    """The source of a function of two directions, in float32, with its constants filled in."""
    spans, here = media.Spans(), service(request)
    media_type = media.negotiate(request.headers.get("accept"), FAMILY)
    lobe = evaluation.requested(parameters)
    spans.mark("parse")

    def work(_cancelled: object) -> export.Shader:
        here.kernels.compile_curve(lobe, FLOAT32)
        bound = bound_at(lobe.formula, lobe.alpha)
        return export.shader(lobe.formula, lobe.alpha, parameters.language, bound=bound)

    cost = SECONDS + here.kernels.curve_cost(lobe, export.ANGLES, FLOAT32)
    return await here.admission.run(request, cost, work, partial(_answer, media_type), spans)


def _answer(media_type: str, shader: export.Shader, spans: media.Spans) -> Response:
    if media_type == media.JSON:
        return media.json(shader.as_dict(), spans)
    return media.response(shader.text, media_type, spans)
