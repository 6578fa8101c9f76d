"""Columns that tables of a run share: what names a formula, and how a time or cost compares with exact Phong's."""

from phongbench.results.columns import Column
from phongbench.results.columns import key_column as _key

#: of every cell of a run: a formula at one exponent in one precision
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
FORMULA = ("approximation", "lambda_form", "space", "beta_policy", "gamma")
#: of what is done to raw vectors, with the values where nothing is
RAW = {"recipe": "pair", "normalise": "none"}
RATIO = (
    Column("ratio", "float64", "time / time of what it is compared with, median over rounds", "1"),
    Column("ratio_low", "float64", "lower end of the ratio's 99 % sign-test interval", "1"),
    Column("ratio_high", "float64", "upper end of that interval", "1"),
)
