"""What the operations on runs and on the service answer: a schema and a real example of each, for the OpenAPI document
and /docs."""

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

_OBJECT: Schema = {"type": "object"}
_NAMES = list_of(TEXT)
_VALUE: Schema = {"type": ["string", "number", "boolean", "null"]}
_COSTS = {
    "cost": or_none(REAL, "what it takes, in `unit`"),
    "unit": told(TEXT, "ns, cycles or slots; operations where only laws answer"),
    "cost_kind": told(TEXT, "measured, compiled, or counted"),
    "bound_by": or_none(TEXT, "what it waits for, of compiled costs"),
}
_RATIOS = {
    "ns": or_none(REAL, "least time of an element on this machine"),
    "ratio": or_none(REAL, "time or cost over that of exact Phong"),
    "ratio_low": or_none(REAL, "lower end of the ratio's 99 % interval"),
    "ratio_high": or_none(REAL, "upper end of it"),
}
_FORMULA = {
    "name": told(TEXT, "its spelling, NAME[:FORM][:GAMMA][:SLOPE][@RECIPE][/NORMALISE]"),
    "approximation": TEXT,
    "space": told(TEXT, "reflect (R, V) or half (N, H)"),
    "recipe": told(TEXT, "how the pair is made of N, L and V; pair where it is given"),
    "normalise": told(TEXT, "how wrong lengths are removed"),
    "gamma": or_none(WHOLE),
    "beta_policy": told(TEXT, "how the slope is chosen"),
    "precision": TEXT,
}
_CHOICE = record(
    {
        **_FORMULA,
        "lambda": TEXT,
        "beta": or_none(REAL, "the slope at the peak"),
        "formula": or_none(TEXT),
        "max_abs": told(REAL, "largest error that was measured, or a law's"),
        "codes_8bit": told(REAL, "the same in steps of an 8-bit channel"),
        "bound": or_none(REAL, "largest error that is promised; what is compared with the budget"),
        "coverage": told(TEXT, "what the promise rests on"),
        "error_coverage": told(TEXT, "how max_abs was found"),
        "samples": or_none(WHOLE),
        **_RATIOS,
        "certified": or_none(REAL, "bound of the formula in exact arithmetic"),
        "work": or_none(REAL, "operations an element, where only laws answer"),
        "target": told(TEXT, "where it would run"),
        **_COSTS,
        "why": told(TEXT, "the reason in words"),
    }
)
RECOMMEND = Answer(
    record(
        {
            "basis": {"type": "string", "enum": ["run", "laws"]},
            "run": or_none(TEXT, "which run answers"),
            "alpha": told(TEXT, "the exponents asked about"),
            "max_error": REAL,
            "length_error": or_none(REAL),
            "precision": TEXT,
            "space": TEXT,
            "working_set": TEXT,
            "contract": FLAG,
            "choices": list_of(_CHOICE, "the cheapest within the budget, then the next; empty where nothing is within"),
            "nearest_miss": {**or_none(_CHOICE), "description": "what is least beyond the budget, of the cheaper ones"},
            "notes": list_of(TEXT),
        },
        optional={
            "target": TEXT,
            "short_of": or_none(TEXT),
            "verdict": told(TEXT, "what to ship, in a sentence"),
            "inputs": told(TEXT, "what the caller holds: vectors, or R.V alone"),
            "usual": _OBJECT,
            "steps": list_of(_OBJECT),
        },
    ),
    example("recommend"),
)
_POINT = record(
    {
        **_FORMULA,
        "lambda_form": TEXT,
        "error": told(REAL, "in the metric asked for, the worst over the exponents"),
        **_RATIOS,
        "state": {"type": "string", "enum": ["on", "off", "unresolved"]},
    },
    optional={
        "target": told(TEXT, "where it would run, if not here"),
        **_COSTS,
        "cost_alone": told(REAL, "the cost where no unit is scarce"),
    },
)
FRONT = Answer(
    record(
        {
            "run": TEXT,
            "alpha": TEXT,
            "alphas": list_of(REAL, "exponents of the run that are meant"),
            "metric": TEXT,
            "stratum": TEXT,
            "precision": TEXT,
            "working_set": TEXT,
            "space": TEXT,
            "timed_precision": told(TEXT, "whose times stand for it"),
            "same_machine": told(FLAG, "whether the run was timed on this kind of machine"),
            "target": TEXT,
            "unit": TEXT,
            "cost_kind": TEXT,
            "notes": list_of(TEXT),
            "points": list_of(_POINT, "fastest first"),
        }
    ),
    example("front"),
)
_CLAIM = record(
    {
        "key": TEXT,
        "claim": TEXT,
        "source": TEXT,
        "verdict": TEXT,
        "because": TEXT,
        "conditions": list_of(_OBJECT, "where it holds and where not"),
        "evidence": list_of(_OBJECT, "the rows that decide: table, key columns, column and value"),
        "coverage": TEXT,
        "rule": told(TEXT, "how it is judged, in words"),
        "figure": or_none(TEXT),
        "needs": _NAMES,
        "lacking": or_none(TEXT, "what would measure it"),
    },
    optional={"brief": told(TEXT, "the reason in few words")},
)
CLAIMS = Answer(record({"run": TEXT, "claims": list_of(_CLAIM)}), example("claims"))
_CHANGE = record(
    {
        "name": told(TEXT, "the formula, without its slope, which costs nothing"),
        **dict.fromkeys(("approximation", "lambda_form", "space", "beta_policy", "precision", "working_set"), TEXT),
        "gamma": or_none(WHOLE),
        "threads": WHOLE,
        "before": told(REAL, "time over exact Phong's in the run `against`"),
        "after": told(REAL, "the same in this run"),
        "ratio": told(REAL, "after / before"),
        "ratio_low": told(REAL, "lower end of its interval"),
        "ratio_high": told(REAL, "upper end of it"),
        "verdict": {"type": "string", "enum": ["faster", "slower", "unresolved"]},
    },
    optional={"recipe": TEXT, "normalise": TEXT, "lit": or_none(REAL)},
)
COMPARISON = Answer(
    record(
        {
            "run": TEXT,
            "against": TEXT,
            "why_not": or_none(TEXT, "why nothing is compared"),
            "level": told(REAL, "of the intervals"),
            "rows": list_of(_CHANGE, "largest change first, of those that are settled"),
        }
    ),
    example("compare"),
)
_TARGET = record(
    {
        "name": TEXT,
        "title": TEXT,
        "cost_kind": {"type": "string", "enum": ["measured", "compiled"]},
        "available": FLAG,
        "why_not": or_none(TEXT),
        "tool": TEXT,
        "unit": TEXT,
        "rows": or_none(WHOLE, "codes that have a cost"),
        "precisions": or_none(_OBJECT, "of these, how many are of each precision's code"),
        "tool_version": or_none(TEXT),
        "needs": or_none(TEXT),
        "compiles": or_none(FLAG),
    }
)
TARGETS = Answer(record({"targets": list_of(_TARGET)}), example("targets"))
_FILE = record({"bytes": WHOLE, "rows": WHOLE, "sha256": TEXT})
_RUN = record(
    {"id": told(TEXT, "what /v1/runs/{run} takes"), "state": {"enum": ["complete", "partial", "corrupt"]}},
    optional={
        "run": TEXT,
        "report": told(FLAG, "whether /runs/{run}/report/ is there"),
        "plan": told(_OBJECT, "what was measured"),
        "files": by_name(_FILE, "the tables"),
        "provenance": told(_OBJECT, "machine, versions, flags, command"),
        "seconds": by_name(REAL),
        "seed": WHOLE,
        "code": told(TEXT, "fingerprint of the sources"),
        "schema": WHOLE,
        "failures": told(_OBJECT, "cells that failed, and why"),
        "violations": list_of(TEXT, "what the run's own checks found"),
        "with": list_of(TEXT, "files of the user's own formulas"),
        "probes": by_name(_OBJECT),
    },
)
RUN = Answer(_RUN, example("run"))
RUNS = Answer(
    record({"runs": list_of(_RUN), "total": WHOLE, "next": or_none(TEXT, "the `cursor` of the next page")}),
    example("runs"),
)
_COLUMN = record(
    {
        "name": TEXT,
        "kind": {"type": "string", "enum": ["text", "whole", "real", "flag"]},
        "unit": told(TEXT, "1 of shares and ratios; empty of names"),
        "meaning": TEXT,
        "key": told(FLAG, "whether it helps to identify a row"),
        "filter": told(FLAG, "whether rows can be filtered by it"),
        "values": or_none(list_of(_VALUE), "those it has, of a filter with few; null among them: missing"),
    }
)
COLUMNS = Answer(
    record({"run": TEXT, "table": TEXT, "meaning": TEXT, "rows": WHOLE, "columns": list_of(_COLUMN)}),
    example("columns"),
)
_COLOUR = list_of(REAL)
_MATERIAL = record({"name": TEXT, "ambient": _COLOUR, "diffuse": _COLOUR, "specular": _COLOUR, "shininess": REAL})
META = Answer(
    record(
        {
            "name": TEXT,
            "version": TEXT,
            "versions": by_name(or_none(TEXT)),
            "precisions": _NAMES,
            "materials": list_of(_MATERIAL),
            "reflectances": by_name(list_of(list_of(REAL)), "red, green and blue at V.H = 0, 1/128, .. 1"),
            "dtypes": _NAMES,
            "languages": by_name(_NAMES, "of /v1/shader, with the precisions of each"),
            "limits": by_name(REAL),
            "cores": WHOLE,
            "media_types": by_name(by_name(_NAMES)),
        }
    ),
    example("meta"),
)
