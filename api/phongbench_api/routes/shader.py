"""A formula as source text."""

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from phongbench.analysis.error_budget import number
from phongbench.analysis.ready_code import ready_code
from phongbench.formulas.shader_code.export import Options, Shader
from phongbench_api.formula_answers import LYON, SHADER
from phongbench_api.http import media
from phongbench_api.http.openapi import described
from phongbench_api.http.problems import request_errors
from phongbench_api.models import ShaderParameters
from phongbench_api.service import service
from phongbench_api.work import evaluation

router = APIRouter(prefix="/v1", tags=["shading"])
FAMILY = (media.TEXT, media.JSON)
#: predicted seconds of writing one, of looking for its largest error, and of proving a bound; a length error is looked
#: for at both ends of each direction's
SECONDS, WITH_LENGTHS = 0.1, 0.3


@router.get(
    "/shader",
    summary="A formula as GLSL, HLSL, WGSL, Metal, ESSL, C, CUDA or NumPy",
    **described(SHADER, 406, 422, 503, also=(media.TEXT,), ask=f"/v1/shader?{LYON}&language=wgsl"),
)
async def shader(request: Request, parameters: Annotated[ShaderParameters, Query()]) -> Response:
    """The source of a function of two directions, or of n, l and v, with its constants filled in."""
    spans, here = media.Spans(), service(request)
    media_type = media.negotiate(request.headers.get("accept"), FAMILY)
    lobe = evaluation.requested(parameters)
    options = _options(parameters)
    spans.mark("parse")

    def work(_cancelled: object) -> Shader:
        with request_errors():
            return ready_code(lobe.formula, lobe.alpha, options, compiles=False)

    cost = WITH_LENGTHS if options.length_error else SECONDS
    return await here.admission.run(request, cost, work, partial(_answer, media_type), spans)


def _options(p: ShaderParameters) -> Options:
    """What was asked; RequestError for what the language or a target does not have."""
    with request_errors():
        wrong = number(p.length_error or 0.0, "length_error")
        targets = tuple(p.target.split(",")) if p.target else ()
        options = Options(p.language, p.precision, p.over_long, wrong, targets)
        options.checked()
        return options


def _answer(media_type: str, shader: Shader, spans: media.Spans) -> Response:
    if media_type == media.JSON:
        return media.json(shader.as_dict(), spans)
    return media.response(shader.text, media_type, spans)
