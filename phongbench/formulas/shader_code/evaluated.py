"""The code that a shader runs, as a Python function: statement by statement, on whatever its functions take.

What a device may return is found by running the emitted code on intervals, so one source says what is shipped and what
is proven of it. Constants are given in full; rounding them is left to the numbers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType
from typing import Any

from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code.function import written
from phongbench.formulas.shader_code.language import Language
from phongbench.formulas.spec import Approximation, Setting


@dataclass(frozen=True)
class _Python(Language):
    """A shading language whose text is Python's."""

    def number(self, value: float) -> str:
        """All digits."""
        return repr(float(value))


_PYTHON = _Python(
    "python", "float", "int", ("direction", "{}"),
    literal=str,
    declared=lambda kind, name, value: f"{name} = {value}",
    header=lambda kind, name, arguments: f"def {name}({', '.join(argument for _, argument in arguments)}):",
    chosen=lambda condition, yes, no: f"chosen(lambda: {condition}, lambda: {yes}, lambda: {no})",
    listed=lambda _, name, values: f"{name} = listed({', '.join(values)})",
    names={"float": "to_float", "int": "to_int"},
    saturated="saturate({})".format,
    function=lambda header, lines: "\n    ".join([header, *lines]),
    returned="return {}".format,
    logic={"and": "and", "or": "or", "not": "not ", "true": "True", "false": "False"},
)  # fmt: skip


@lru_cache(1024)
def text(spec: Approximation, formula: Formula, setting: Setting, *, limited: bool = True) -> str:
    """The function as Python's text; `limited` as for `written`."""
    return written(spec, formula, setting, _PYTHON, limited=limited)


@lru_cache(1024)
def _compiled(spec: Approximation, formula: Formula, setting: Setting, limited: bool) -> CodeType:
    return compile(text(spec, formula, setting, limited=limited), f"<{formula}>", "exec")


def highlight(
    spec: Approximation, formula: Formula, setting: Setting, functions: Mapping[str, Any], *, limited: bool = True
) -> Callable[..., Any]:
    """The function `highlight` of directions.

    functions  by GLSL's names: dot, cross, inversesqrt, pow, exp2, sqrt, acos, clamp, saturate, max, min, floor, round,
               float_bits and bits_float; to_int and to_float between floats and whole numbers; `listed` makes a table
               of its arguments; `chosen` takes a condition and both values, each to be called
    limited    whether over-long vectors give no more than 1
    Raises KernelError for a body that has no spelling, InputError for tricks of processors.
    """
    names = dict(functions)
    exec(_compiled(spec, formula, setting, limited), names)
    return names["highlight"]  # type: ignore[no-any-return]
