"""Parameters of requests as models: names, bounds and examples come from the registry, and go into the OpenAPI."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from phongbench.analysis.error_budget import Budget as ErrorBudget
from phongbench.compiler.lowering import PRECISIONS
from phongbench.formulas import slopes
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.spec import ReflectanceFormula
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, RECIPES
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import LANGUAGES, OVER_LONG
from phongbench.formulas.shader_code.language import HELD
from phongbench.formulas.spec import ALPHA, GAMMA, SPACES
from phongbench.inputs.strata import STRATUM_NAMES
from phongbench.results.schema import CPU, ERROR_METRICS, TABLES
from phongbench.targets.chips import TARGETS
from phongbench.targets.target import UNITS
from phongbench.timing.blocks import WORKING_SETS
from phongbench_api.http.openapi import object_schema


class OneOf:
    """A name out of those known: an enumeration in the schema, and a refusal that lists them without what was sent."""

    def __init__(self, names: Iterable[Any]) -> None:
        self.names = list(dict.fromkeys(names))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """pydantic asks for it."""
        return core_schema.literal_schema(self.names)


GAMMA_VALUES = [1 << n for n in range(int(GAMMA.low).bit_length() - 1, int(GAMMA.high).bit_length())]


class _Gamma:
    """Powers of two; a query's text is read as a whole number first."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """pydantic asks for it."""
        known = core_schema.literal_schema(GAMMA_VALUES)
        return core_schema.chain_schema([core_schema.int_schema(), known])

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        """pydantic asks for it."""
        return {"type": "integer", "enum": GAMMA_VALUES}


POLICIES = tuple(dict.fromkeys(policy for spec in REGISTRY.values() for policy in spec.slopes))

ApproximationName = Annotated[str, OneOf(REGISTRY)]
FormName = Annotated[str, OneOf([*LAMBDA_FORMS, "none"])]
PolicyName = Annotated[str, OneOf([*slopes.OFFSETS, *POLICIES])]
SpaceName = Annotated[str, OneOf(SPACES)]
#: whose costs count: this machine's times, a compiled target's, or those of one that was measured and added
TargetName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{1,62}$", examples=[CPU, *TARGETS])]
TargetNames = Annotated[str, Field(pattern=r"^[a-z0-9-]{1,63}(,[a-z0-9-]{1,63}){0,31}$")]
#: the unit that is scarce there
UnitName = Annotated[str, OneOf(UNITS)]
PrecisionName = Annotated[str, OneOf(PRECISIONS)]
#: a formula in one word
Spelling = Annotated[str, Field(max_length=80, examples=["lyon:cross:8", "lyon:dot:8:minimax"])]
GammaValue = Annotated[int, _Gamma()]
AlphaValue = Annotated[float, Field(ge=0, le=ALPHA.high, allow_inf_nan=False)]
#: 50, or 10,50,200, or 10..200
Alphas = Annotated[
    str,
    Field(
        pattern=r"^[0-9]{1,6}(\.[0-9]{1,12})?((\.\.[0-9]{1,6}(\.[0-9]{1,12})?)|(,[0-9]{1,6}(\.[0-9]{1,12})?){0,31})$",
        examples=["50", "10,50,200", "10..200"],
    ),
]
#: 0.004, 1e-3 or 1/255
Budget = Annotated[
    str,
    Field(pattern=r"^[0-9]{1,6}(\.[0-9]{0,12})?([eE]-?[0-9]{1,2})?(/[1-9][0-9]{0,8})?$", examples=["1/255", "0.02"]),
]
#: how wrong a curve's vectors may be
LONGEST = 0.5
RunName = Annotated[str, Field(pattern=r"^(latest|[a-z0-9][a-z0-9-]{7,63})$", examples=["latest"])]


class Parameters(BaseModel):
    """A request's parameters; a name that is not one of them is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=False)


class FormulaParameters(Parameters):
    """Which formula at which exponent: `formula`, or `approximation` and its parts; what is left out is its default."""

    formula: Spelling | None = Field(None, description="NAME[:FORM][:GAMMA][:SLOPE][@RECIPE], instead of its parts")
    approximation: ApproximationName | None = Field(None, description="name of the formula", examples=["lyon"])
    lambda_form: FormName | None = Field(
        None, alias="lambda", description="how 1 - cos is computed", examples=["cross"]
    )
    gamma: GammaValue | None = Field(None, description=GAMMA.meaning, examples=[8])
    alpha: AlphaValue = Field(description=ALPHA.meaning, examples=[50])
    beta: PolicyName | None = Field(None, description="policy that chooses the slope at the peak", examples=["taylor"])
    space: SpaceName | None = Field(None, description="reflect: pairs (R, V); half: pairs (N, H)")


class SpecularParameters(FormulaParameters):
    """The specular term of pairs."""

    precision: PrecisionName = Field("float32", description="working precision of the formula")
    compare: bool = Field(False, description="also the exact term and the largest error")


class BinaryParameters(SpecularParameters):
    """The same, in the query of a binary request."""

    dtype: Annotated[str, OneOf(["f4", "f8"])] = Field("f4", description="of raw octets; .npy says its own")


class CurveParameters(FormulaParameters):
    """A formula over the angle between R and V."""

    points: int = Field(361, ge=2, le=10_000, description="angles from 0 on")
    degrees: float = Field(90.0, gt=0.0, le=180.0, allow_inf_nan=False, description="the largest angle")
    spacing: Annotated[str, OneOf(["even", "square"])] = Field(
        "even",
        description="square: angles go as the square of their number, so that a tight lobe has its share of them",
    )
    precision: PrecisionName = Field("float64", description="working precision of the formula")
    length_error: float = Field(
        0.0, ge=-LONGEST, le=LONGEST, allow_inf_nan=False, description="relative and signed: 0.01 is 1 % too long"
    )
    perturbation: Annotated[str, OneOf(["a", "both", "opposite"])] = Field(
        "a", description="whose length is wrong: one vector's, both alike, or one too long and the other too short"
    )


class ShaderParameters(FormulaParameters):
    """A formula in a language."""

    language: Annotated[str, OneOf(LANGUAGES)] = Field("glsl", description="what it is written in")
    precision: Annotated[str, OneOf(HELD)] = Field("float32", description="of its floats, if the language has it")
    over_long: Annotated[str, OneOf(OVER_LONG)] = Field(
        "clamp", description="whether vectors longer than 1 give no more than 1 on GPUs, or what the formula says"
    )
    length_error: Budget | None = Field(None, description="how wrong lengths may be, for the error: 0.01 is up to 1 %")
    target: TargetNames | None = Field(None, description="compiled targets whose costs are told", examples=["rdna2"])


class FrontParameters(Parameters):
    """A run's error/time front."""

    alpha: Alphas = Field(description="one exponent, several, or a range: errors are the worst over them")
    metric: Annotated[str, OneOf(ERROR_METRICS)] = Field("max_abs", description="column of the accuracy rows")
    stratum: Annotated[str, OneOf(STRATUM_NAMES)] | None = Field(
        None, description="which inputs; left out: highlight, and of formulas of (N, H) configurations"
    )
    precision: PrecisionName = "float32"
    working_set: Annotated[str, OneOf(WORKING_SETS)] = Field("l1", description="whose times")
    space: SpaceName = "reflect"
    target: TargetName = CPU
    short_of: UnitName | None = None


class RecommendParameters(Parameters):
    """An error budget."""

    alpha: Alphas = Field(description="one exponent, several, or a range")
    max_error: Budget = Field(description="largest absolute error allowed")
    length_error: Budget | None = Field(None, description="how wrong vector lengths may be: 0.01 is up to 1 %")
    mesh_angle: float | None = Field(
        None, ge=0, lt=180, description="instead: degrees between the normals at the ends of a mesh's edge"
    )
    raw: bool = Field(False, description="choose among recipes from raw N, L and V")
    contract: bool = Field(False, description="within on every device that keeps the accuracies of WGSL and Vulkan")
    precision: PrecisionName = "float32"
    space: SpaceName = "reflect"
    working_set: Annotated[str, OneOf(WORKING_SETS)] = "l1"
    target: TargetName = CPU
    short_of: UnitName | None = None
    run: RunName | None = Field(None, description="which run answers; left out: the newest with times, or the laws")

    def budget(self) -> ErrorBudget:
        """The budget among them."""
        return ErrorBudget.of(**{field.name: getattr(self, field.name) for field in fields(ErrorBudget)})


class PageParameters(Parameters):
    """A page of a list."""

    limit: int = Field(50, ge=1, le=1000, description="entries of an answer")
    cursor: str | None = Field(None, max_length=200, description="`next` of the answer before")


class CompareParameters(Parameters):
    """Two runs."""

    against: RunName = Field(description="the run that this one is compared with: its id, or latest")


class ColumnsParameters(Parameters):
    """A table of a run."""

    table: Annotated[str, OneOf(TABLES)] = Field(description="whose columns", examples=["timing"])


#: a formula inside a JSON body: its spelling, or its parts
SPELLING_SCHEMA: dict[str, Any] = {
    "type": "string",
    "description": "NAME[:FORM][:GAMMA][:SLOPE][@RECIPE][/NORMALISE]",
    "examples": ["lyon:difference:8"],
}
_PARTS: dict[str, Any] = {
    "approximation": {"type": "string", "enum": list(REGISTRY)},
    "lambda": {"type": ["string", "null"], "enum": [*LAMBDA_FORMS, "none", None]},
    "gamma": {"type": ["integer", "null"], "minimum": int(GAMMA.low), "maximum": int(GAMMA.high)},
    "beta": {"type": ["string", "number", "null"], "description": "a policy, or the slope itself"},
    "recipe": {"type": ["string", "null"], "enum": [PAIR, *RECIPES, None]},
    "normalise": {"type": ["string", "null"], "enum": [*NORMALISE, None]},
}
FORMULA_SCHEMA = {"anyOf": [SPELLING_SCHEMA, object_schema(_PARTS)]}


def _fresnel_schema(formula: ReflectanceFormula) -> dict[str, Any]:
    """A kind of reflectance with what it takes, for red, green and blue."""
    given = {
        p.name: {
            "type": "array",
            "items": {"type": "number", "minimum": p.low, "maximum": p.high},
            "minItems": 3,
            "maxItems": 3,
            "description": p.meaning,
        }
        for p in formula.parameters
    }
    return object_schema({"kind": {"type": "string", "enum": [formula.name]}, **given}, "kind", *given)


#: reflectance against incidence of a material inside a JSON body
FRESNEL_SCHEMA = {
    "anyOf": [_fresnel_schema(formula) for formula in KINDS.values()],
    "description": "the highlight's colour is specular times this, at V.H; left out: constant, 1",
}
