"""What a language must say of itself for a formula to be written in it, and what those after C have in common."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from phongbench.errors import InputError, UnknownNameError

#: functions that every language has
_BUILT_IN = """
    abs acos ceil clamp exp exp2 floor guarded guarded_square inverseSqrt inversesqrt length limited log log2 max min
    mix multiply_add normalize np pow reflect rint round rsqrt saturate saturated_sum select sign sqrt
"""
BUILT_IN = frozenset(_BUILT_IN.split())
#: words of GLSL, HLSL, WGSL, Metal, C, C++ and Python that a kernel's author may well have taken for a name
_TAKEN = """
    active alignas alignof and array as asm assert async atomic auto await bool break buffer case cast catch centroid
    char class coherent column_major common compile const constant constexpr continue convert def default del delete
    demote device discard do double dword elif else enum except explicit export extern external false far filter final
    finally fixed flat float for fragment friend from get global goto half highp if import in inline inout input int
    interface invariant is kernel lambda layout let line lineadj linear long lowp matrix mediump meta metal module
    move mut namespace near new noinline none nonlocal not null of operator or out output override packed partition
    pass patch pixelfragment point precise precision premerge priv private protected public raise readonly ref
    register require resource restrict return row_major sample sampler self set shared short signed sizeof smooth
    snorm stateblock static string struct subroutine super superp switch table target technique template texture this
    thread threadgroup throw triangle true try type typedef typeid typename uniform union unless unorm unsigned use
    using var varying vector vertex virtual void volatile wgsl where while with write yield
"""
RESERVED = frozenset(_TAKEN.split())
#: what directions and values may be held in
FLOAT32, FLOAT16, MEDIUMP = "float32", "float16", "mediump"
#: the numbers that each is measured in, and whose constants it takes: mediump is at least a float16
HELD: Mapping[str, type[np.floating[Any]]] = {FLOAT32: np.float32, FLOAT16: np.float16, MEDIUMP: np.float16}


def braced(header: str, lines: list[str]) -> str:
    """A function between braces."""
    body = (line if line.startswith("#") else f"    {line}" for line in lines)  # a directive stands at the margin
    return "\n".join([f"{header} {{", *body, "}"])


def c_declared(kind: str, name: str, value: str) -> str:
    """A variable as C declares it."""
    return f"{kind} {name} = {value};"


def c_header(kind: str, name: str, arguments: list[tuple[str, str]]) -> str:
    """What stands before a function's brace in C."""
    return f"{kind} {name}({', '.join(f'{k} {n}' for k, n in arguments)})"


def c_chosen(condition: str, yes: str, no: str) -> str:
    """One of two values in C."""
    return f"{condition} ? {yes} : {no}"


def c_listed(kind: str, name: str, values: list[str]) -> str:
    """A constant table in C."""
    return f"static const {kind} {name}[{len(values)}] = {{{', '.join(values)}}};"


def glsl_listed(kind: str, name: str, values: list[str]) -> str:
    """A constant table in GLSL."""
    return f"const {kind} {name}[{len(values)}] = {kind}[{len(values)}]({', '.join(values)});"


@dataclass(frozen=True)
class Language:
    """How one language writes scalar code.

    name          for the command line
    suffixes      of files that it is written to, besides its name
    float_type    the float that it computes with; integers likewise
    direction     type and name of an argument that is a direction; {} is the name
    literal       shortest decimal text of a float -> its literal
    declared      (type, name, expression) -> a statement that makes a variable, which may change later
    header        (result type, name, arguments as (type, name)) -> what stands before a function's brace
    chosen        (condition, where true, where false) -> an expression, all three given in brackets where needed
    listed        (type, name, values as literals) -> statement of a constant table
    names         of built-in functions, where they differ from GLSL's
    helpers       name -> text of a function that the language lacks, put in front where it is called
    lacks         what it has no way to write: "float_bits" and the like, and "TABLE"
    preamble      what stands above all functions
    note          what whoever compiles it must know; "" for nothing
    components    a direction's components, where the language has no dot and cross of its own; else None
    unpacked      names of directions -> the statements that make their components
    gpu           it runs on GPUs, which flush subnormal numbers and have minima, maxima and limits as instructions
    saturated     an expression -> the same limited to 0..1, on GPUs
    saturated_sum  name of the helper of a multiply-add that is limited to 0..1, (factor, factor, summand), where it is
                  one instruction which the compiler does not make of `saturated`; "" elsewhere
    fused         whether multiply-adds are calls of `multiply_add`; elsewhere compilers decide
    leaving       (cosine, 0) -> lines that return 0 at once for a cosine that is not positive, NaN included, on the
                  processors where that is cheaper than to choose at the end
    returned      an expression -> the statement that returns it
    function      (header, statements) -> a function
    logic         its words for and, or, not, true and false
    tight         whether the words for and and or bind closer than comparisons
    comment       what begins one
    precision     of FLOAT32, FLOAT16 and MEDIUMP: what it is written in
    precisions    the others that it can be written in -> what of all this is then another
    """

    name: str
    float_type: str
    integer_type: str
    direction: tuple[str, str]
    literal: Callable[[str], str]
    declared: Callable[[str, str, str], str]
    header: Callable[[str, str, list[tuple[str, str]]], str]
    chosen: Callable[[str, str, str], str]
    listed: Callable[[str, str, list[str]], str]
    suffixes: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    helpers: Mapping[str, str] = field(default_factory=dict)
    lacks: Mapping[str, str] = field(default_factory=dict)
    preamble: str = ""
    note: str = ""
    components: tuple[str, str, str] | None = None
    unpacked: Callable[[list[str]], list[str]] = lambda names: []
    gpu: bool = True
    saturated: Callable[[str], str] = "clamp({}, 0.0, 1.0)".format
    saturated_sum: str = ""
    fused: bool = False
    leaving: Callable[[str, str], list[str]] = lambda cosine, dark: []
    returned: Callable[[str], str] = "return {};".format
    function: Callable[[str, list[str]], str] = braced
    logic: Mapping[str, str] = field(
        default_factory=lambda: {"and": "&&", "or": "||", "not": "!", "true": "true", "false": "false"}
    )
    tight: bool = False
    comment: str = "//"
    precision: str = FLOAT32
    precisions: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def number(self, value: float) -> str:
        """The float nearest to the value, in the fewest digits that give it back."""
        return self.literal(str(HELD[self.precision](value)))

    def word(self, name: str) -> str:
        """The name, changed where the language, or another of them, has taken it."""
        return f"{name}_" if name in RESERVED or name.startswith("gl_") else name.replace("__", "_")

    def function_name(self, name: str) -> str:
        """What it calls a function of GLSL's; InputError for what it has no way to write."""
        if name in self.lacks:
            raise InputError(f"{self.name} in {self.precision} has no {self.lacks[name]}", "language", _others(name))
        return self.names.get(name, name)

    def in_precision(self, precision: str) -> "Language":
        """The language with floats of this precision; InputError where it has none."""
        if precision not in HELD:
            raise UnknownNameError("precision", precision, HELD, "precision")
        if precision == self.precision:
            return self
        if precision not in self.precisions:
            fix = f"write {', '.join((self.precision, *self.precisions))}, or choose another language"
            raise InputError(f"{self.name} has no {precision}", "precision", fix)
        return replace(self, precision=precision, **self.precisions[precision])


def _others(name: str) -> str:
    if name == "TABLE":
        return "write it in another language, e.g. essl300 or glsl, or choose a formula without a table"
    return "write it in float32 and another language, e.g. essl300 or glsl, or choose a formula that reads no bits"
