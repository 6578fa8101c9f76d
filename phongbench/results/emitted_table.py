"""The table of how wrong written code is, whose folded constants are another rounding than the kernels'."""

from phongbench.results.columns import Column
from phongbench.results.columns import key_column as _key
from phongbench.results.columns import table as _table
from phongbench.results.formula_columns import BY_NAME

_FORMULA = ("approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "beta", "precision")
EMITTED = _table(
    "Errors of the code that `phongbench shader` writes, every operation rounded to nearest",
    *(BY_NAME[name] for name in _FORMULA),
    _key("code", "str", "gpu for shading languages and CUDA, whose helpers differ, or c for C and NumPy"),
    _key("fused", "bool", "multiply-adds of folded constants round once; no row where the code has none"),
    _key("stratum", "str", "cosines: the formula is given a cosine; angles: pairs of vectors in a plane"),
    Column("samples", "int64", "inputs evaluated", "count"),
    Column("max_abs", "float64", "largest |error|, the error being value - exact", "1"),
    Column("mean_abs", "float64", "mean |error|", "1"),
    Column("rms", "float64", "root of the mean squared error", "1"),
    Column("bias", "float64", "mean error", "1"),
    Column("max_above", "float64", "largest value - exact", "1"),
    Column("max_below", "float64", "largest exact - value", "1"),
    Column("codes_8bit", "float64", "largest |error| in steps of an 8-bit channel", "codes"),
    Column("change_max", "float64", "largest change from what the kernel gives for the same input", "1"),
    Column("coverage", "str", "exhaustive: every cosine that the precision holds; sampled"),
    Column("nonfinite", "int64", "values that are NaN or infinite, left out of the errors", "count"),
    Column("above_one", "int64", "values above 1", "count"),
    Column("negative", "int64", "values below 0", "count"),
)
