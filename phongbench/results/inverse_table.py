"""The table of what formulas do to normals."""

from phongbench.results.columns import Column
from phongbench.results.columns import key_column as _key
from phongbench.results.columns import table as _table
from phongbench.results.formula_columns import BY_NAME

_LOBE = tuple(BY_NAME[name] for name in ("approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"))
INVERSE = _table(
    "What a formula does to normals: pictures by exact Phong, inverted with the formula in its place",
    *_LOBE,
    _key("surface", "str", "sphere, vase, bumps or tent"),
    _key("lights", "int64", "30 degrees from the viewer; of 1, the nearest normals that explain it", "count"),
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
