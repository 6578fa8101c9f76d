"""The table of what formulas cost where they ship: beside this machine's times, what the chips' compilers count."""

from phongbench.results.columns import Column, key_column, table
from phongbench.results.formula_columns import BY_NAME, FORMULA, RAW

_BEYOND = "beyond the dot product, a call"

COSTS = table(
    "What a highlight costs on a target: measured, or counted in the machine code that the chip's compiler makes of it",
    key_column("target", "str", "where it runs: cpu, gpu (an adapter of this machine), or a chip that is compiled for"),
    key_column("cost_kind", "str", "measured: a time with an interval; compiled: counted, the same to the digit"),
    *(BY_NAME[name] for name in (*FORMULA, *RAW, "precision")),
    key_column(
        "alpha", "float64", "exponent whose code it is; at others it differs by a gate at most, and by the power"
    ),
    key_column("context", "int64", "multiply-adds that the shader does around each highlight", "count"),
    Column(
        "reads",
        "int64",
        "bytes that it reads from memory of a texture's size around each highlight",
        "bytes",
        key=True,
        optional=True,
    ),
    Column("unit", "str", "of cost, issue and busy: ns; cycles of a wave or an element; slots of a warp"),
    Column(
        "cost", "float64", "compiled: of the busiest unit, beyond the dot product; measured: of the whole highlight"
    ),
    Column("over_dot", "float64", "cost with the dot product / that of a bare dot product", "1"),
    Column("ratio", "float64", "cost with the dot product / exact Phong's on the same target", "1"),
    Column("ratio_low", "float64", "lower end of the ratio's 99 % interval; compiled: the ratio", "1"),
    Column("ratio_high", "float64", "upper end of that interval", "1"),
    Column("bound_by", "str", "the unit that limits the program: issue or special; missing where it is measured"),
    Column("issue", "float64", f"of the unit that issues instructions, {_BEYOND}"),
    Column("busy", "float64", f"of the special unit, {_BEYOND}"),
    Column("instructions", "float64", f"all, {_BEYOND}", "count"),
    Column("fp32", "float64", f"without the special ones, {_BEYOND}", "count"),
    Column("special", "float64", f"logarithms, exponentials, roots, reciprocals, {_BEYOND}", "count"),
    Column("latency", "float64", "cycles that a call adds to one wave or thread alone; missing if not known", "cycles"),
    Column("registers", "Int64", "of the program that calls it many times; missing if not known", "count"),
    Column("tool", "str", "the compiler, or what measured"),
    Column("tool_version", "str", "its version"),
)
