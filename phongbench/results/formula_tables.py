"""Columns that name a formula, and the tables of what is known of its lobe as a whole: no other table shares theirs."""

from phongbench.results.columns import Column
from phongbench.results.columns import key_column as _key
from phongbench.results.columns import table as _table

CELL_COLUMNS = (
    _key("approximation", "str", "name of the formula"),
    _key("lambda_form", "str", "how lambda is computed: dot, difference, cross, tan2; none for formulas of the cosine"),
    _key("space", "str", "the pair of vectors: reflect (R, V) or half (N, H)"),
    _key("beta_policy", "str", "how the slope beta is chosen: taylor, minimax, energy, ...; none without a slope"),
    _key("alpha", "float64", "exponent of exact Phong"),
    _key("gamma", "Int64", "power that the chain of squarings reaches; missing for formulas without one"),
    Column("beta", "float64", "slope at the peak; missing for formulas without one"),
    _key("precision", "str", "working precision; `exact` for certified rows"),
    _key("gated", "bool", "values are 0 where a.b <= 0"),
    _key("recipe", "str", "how the pair is made of N, L, V: reflect, lengthwise, halfway; pair where it is given"),
    _key("normalise", "str", "how wrong lengths are removed: none, each, once, squared, fast, estimate"),
)
BY_NAME = {column.name: column for column in CELL_COLUMNS}
_LOBE = tuple(BY_NAME[name] for name in ("approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"))
_OF_LAW = "by closed form, for light along the normal; missing where there is none"
MOMENTS = _table(
    "What the lobe of a formula sends where, above the horizon, for light of unit intensity along its peak",
    *_LOBE,
    BY_NAME["beta"],
    _key("incidence_degrees", "float64", "of the light, from the normal", "degrees"),
    Column("energy", "float64", "integral of the lobe over directions", "sr"),
    Column("energy_ratio", "float64", "energy over that of exact Phong", "1"),
    Column("momentum", "float64", "the part of it along the mirrored direction", "sr"),
    Column("momentum_ratio", "float64", "momentum over that of exact Phong", "1"),
    Column("sideways", "float64", "the part across it in the plane of incidence, towards the normal", "sr"),
    Column("half_width_degrees", "float64", "angle between R and V at half of the peak; missing if never", "degrees"),
    Column("half_width_ratio", "float64", "half width over that of exact Phong", "1"),
    Column("energy_law", "float64", f"energy {_OF_LAW}", "sr"),
    Column("momentum_law", "float64", f"momentum {_OF_LAW}", "sr"),
)
CUTS = _table(
    "Where the lobe of a formula is cut off, in the plane of incidence",
    *_LOBE,
    Column("cut_degrees", "float64", "angle between R and V from which it is 0; missing where it never is", "degrees"),
    Column("step", "float64", "value a degree before that angle", "1"),
    Column("codes", "float64", "the same in steps of an 8-bit channel", "codes"),
    Column("at_90", "float64", "value at 90 degrees between R and V", "1"),
)
INVERSE = _table(
    "What a formula does to normals: pictures by exact Phong, inverted with the formula in its place",
    *_LOBE,
    _key("surface", "str", "sphere, vase, bumps or tent"),
    _key(
        "lights", "int64", "around the viewer, 30 degrees from him; of 1, the nearest normals that explain it", "count"
    ),
    _key("noise", "str", "of pictures: none, gaussian of a code, or 8bit for rounding to codes"),
    Column("samples", "int64", "pixels of the surface", "count"),
    Column("known", "int64", "pixels whose samples give a normal", "count"),
    Column("mean_degrees", "float64", "mean angle between the normal and the true one", "degrees"),
    Column("median_degrees", "float64", "median of it", "degrees"),
    Column("max_degrees", "float64", "largest of it", "degrees"),
    Column("far_share", "float64", "share of pixels off by more than 1 degree", "1"),
    Column("depth_rmse", "float64", "of heights up to a constant, over the surface's range of heights", "1"),
    Column("residual_rms", "float64", "difference between pictures and model", "1"),
    Column("evaluations", "float64", "of the formula for each pixel, its derivative included", "count"),
)
