"""What the operations that need no run answer: a schema and a real example of each; see `answers` for the others."""

from phongbench.inverse.line import MARKS
from phongbench_api.http.shapes import (
    FLAG,
    REAL,
    TEXT,
    WHOLE,
    Answer,
    Schema,
    by_name,
    example,
    list_of,
    or_none,
    record,
    told,
)

#: a formula, for examples of requests
LYON = "approximation=lyon&lambda=cross&gamma=8&alpha=50"
_OBJECT: Schema = {"type": "object"}
_NAMES = list_of(TEXT)
_PARAMETER = record({"name": TEXT, "meaning": TEXT, "low": REAL, "high": REAL, "unit": TEXT, "whole": FLAG})
_APPROXIMATION = record(
    {
        **dict.fromkeys(("name", "title", "kind", "formula", "domain", "cost", "source"), TEXT),
        **dict.fromkeys(("lambda_forms", "spaces", "beta_policies", "also"), _NAMES),
        "parameters": list_of(_PARAMETER),
        "support": or_none(_OBJECT, "where it is exactly 0, by the example of one setting"),
        "takes_alpha_0": FLAG,
        "normalise": by_name(_NAMES, "ways of removing lengths by lambda form"),
    }
)
APPROXIMATION = Answer(_APPROXIMATION, example("approximation"))
APPROXIMATIONS = Answer(record({"approximations": list_of(_APPROXIMATION)}), example("approximations"))
SHADER = Answer(
    record(
        {
            "language": TEXT,
            "text": told(TEXT, "the source"),
            "max_error": told(REAL, "largest error against exact Phong that was sampled"),
            "bound": or_none(REAL, "what is promised of directions made unit in float32"),
            "contract": or_none(REAL, "the same on every device that keeps to WGSL and Vulkan"),
            "precision": TEXT,
            "costs": list_of(_OBJECT, "on the targets asked for"),
        }
    ),
    example("shader"),
)
CURVE = Answer(
    record(
        {
            "name": TEXT,
            **{name: list_of(REAL) for name in ("angle_degrees", "value", "exact", "error")},
            "max_abs_error": REAL,
            "worst_index": WHOLE,
            "beta": or_none(REAL),
            "cutoff_degrees": or_none(REAL, "angle beyond which it is 0"),
        }
    ),
    example("curve"),
)
_PAIR, _HEIGHT = list_of(or_none(REAL)), list_of(or_none(REAL))
INVERSE_LINE = Answer(
    record(
        {
            "x": list_of(REAL),
            "normals": list_of(_PAIR, "(x, z); the one that the prior means"),
            "other": list_of(_PAIR, "the other one that explains the same intensity"),
            "height": _HEIGHT,
            "height_low": _HEIGHT,
            "height_high": _HEIGHT,
            "marks": list_of({"type": "string", "enum": list(MARKS)}),
            "notes": _NAMES,
        },
        optional={"light_length": REAL, "light_degrees": REAL},
    ),
    example("inverse_line"),
)
