"""Elementwise loops that differ only in the bodies in them, compiled by numba once for all.

A loop is a closure over its bodies. numba compiles it with stand-ins, functions that are declared and not defined;
every loop is that text with its own bodies written beside it by `tracing`, which LLVM then optimises as one. Of the two
hundred loops of a study numba compiles twenty.
"""

import copy
import hashlib
from dataclasses import dataclass
from functools import cache
from types import CellType, FunctionType
from typing import Any

import numpy as np

from phongbench.compiler import inlining, late_numba
from phongbench.compiler.inlining import Body, TypedBody

ir: Any = late_numba.Late("llvmlite.ir")
ccallback: Any = late_numba.Late("numba.core.ccallback")
numba: Any = late_numba.Late("numba")

#: what a loop may close over beside its bodies: what repr tells from everything else
_PLAIN = (bool, int, float, str, type, np.number, FunctionType)


def compiled(loop: Body, signature: Any, options: dict[str, Any], *, cached: bool = True) -> Any:
    """numba's C callback of an elementwise loop, compiled now or loaded from numba's cache."""
    made = _kind()(loop, numba.core.sigutils.normalize_signature(signature), {}, options)
    if cached:
        made.enable_caching()
    made.compile()
    return made


@cache
def _kind() -> Any:
    class Elementwise(ccallback.CFunc):  # type: ignore[misc]
        """A C callback that is compiled by a template, where its loop has bodies."""

        def enable_caching(self) -> None:
            """Use numba's cache, to which equal loops compiled by other options are one."""
            super().enable_caching()
            cache, options = self._cache, repr(self._compiler.targetoptions)
            known = cache._index_key  # noqa: SLF001
            cache._index_key = lambda *loop: (*known(*loop), options)  # noqa: SLF001

        def _compile_uncached(self) -> Any:
            with numba.core.event.trigger_event("numba:compile", data={"dispatcher": self._pyfunc}):
                return _result(self._pyfunc, self._sig, self._compiler)

    return Elementwise


class _StandIn:
    """A function that a template calls and does not define.

    How it is called, and by which of numba's contexts, is known once the template is compiled.
    """

    def __init__(self, name: str, body: TypedBody) -> None:
        self.name, self.function, self.fndesc = name, body.stand_in(self._call), None

    def _call(self, context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        self.context, self.flags = context, numba.core.targetconfig.ConfigStack().top().copy()
        self.sig = sig
        self.fndesc = numba.core.funcdesc.ExternalFunctionDescriptor(self.name, sig.return_type, sig.args)
        return context.call_internal(builder, self.fndesc, sig, arguments)

    def define(self, body: TypedBody, library: Any) -> str:
        """Add a body by this name to a library; its text."""
        context, module = self.context, library.create_ir_module(self.name)
        function = context.declare_function(module, self.fndesc)
        function.attributes.add("alwaysinline")
        builder = ir.IRBuilder(function.append_basic_block("entry"))
        with context.push_code_library(library), numba.core.targetconfig.ConfigStack().enter(self.flags.copy()):
            given = context.call_conv.decode_arguments(builder, self.sig.args, function)
            value = body.write(context, builder, self.sig, given)
            context.call_conv.return_value(builder, context.get_return_value(builder, self.sig.return_type, value))
            context.post_lowering(module, library)
        library.add_ir_module(module)
        library.get_function(self.name).linkage = "internal"
        return str(module)


@dataclass(frozen=True)
class _Template:
    """A loop that lacks its bodies, and numba's result of compiling it."""

    loop: Body
    result: Any
    stand_ins: tuple[_StandIn, ...]
    text: bytes

    def filled(self, bodies: list[TypedBody]) -> Any:
        """numba's result of the loop with these bodies, one for each stand-in."""
        empty, fndesc = self.result.library, copy.copy(self.result.fndesc)
        library = self.result.codegen.create_library(empty.name)
        library.enable_object_caching()
        library._final_module = empty._final_module.clone()  # noqa: SLF001  numba would add it as text
        for linked in empty._linking_libraries:  # noqa: SLF001
            library.add_linking_library(linked)
        digest = hashlib.sha256(self.text)
        for stand_in, body in zip(self.stand_ins, bodies, strict=True):
            if stand_in.fndesc:  # called, and not by a branch that its loop never takes
                digest.update(stand_in.define(body, library).encode())
        fndesc.mangled_name += f".{digest.hexdigest()[:16]}"  # one engine holds all loops, by name
        for name, renamed in (
            (self.result.fndesc.llvm_func_name, fndesc.llvm_func_name),
            (self.result.fndesc.llvm_cfunc_wrapper_name, fndesc.llvm_cfunc_wrapper_name),
        ):
            library.get_function(name).name = renamed
        return self.result._replace(library=library, fndesc=fndesc)


_TEMPLATES: dict[Any, _Template] = {}


def _result(loop: Body, signature: Any, compiler: Any) -> Any:
    """numba's result for this loop: by a template, if it closes over bodies and, beside these, plain values only."""
    cells = [cell.cell_contents for cell in loop.__closure__ or ()]
    bodies = [body for body in map(inlining.typed, cells) if body]
    rest = [value for value in cells if not inlining.typed(value)]
    if not bodies or not all(isinstance(value, _PLAIN) for value in rest):
        return compiler.compile(signature.args, signature.return_type)
    key = (loop.__code__, id(loop.__globals__), signature, repr(compiler.targetoptions), *map(_told, cells))
    if key not in _TEMPLATES:
        _TEMPLATES[key] = _template(loop, cells, signature, compiler)
    return _TEMPLATES[key].filled(bodies)


def _told(value: Any) -> tuple[Any, ...]:
    """What a template has of a value that its loop closes over: of a body, only its type."""
    body = inlining.typed(value)
    if body:
        return TypedBody, repr(body.result)
    return type(value), value if isinstance(value, type | FunctionType) else repr(value)


def _template(loop: Body, cells: list[Any], signature: Any, compiler: Any) -> _Template:
    stand_ins = {
        at: _StandIn(f"phongbench.body.{at}", body) for at, body in enumerate(map(inlining.typed, cells)) if body
    }
    held = tuple(CellType(stand_ins[at].function if at in stand_ins else value) for at, value in enumerate(cells))
    empty = FunctionType(loop.__code__, loop.__globals__, loop.__name__, loop.__defaults__, held)
    empty.__module__, empty.__qualname__ = loop.__module__, loop.__qualname__
    alone = type(compiler)(empty, compiler.targetdescr, compiler.targetoptions, {}, compiler.pipeline_class)
    # what numba wrote down for people is the same for all, and costs as much for each loop as its bodies
    result = alone.compile(signature.args, signature.return_type)._replace(type_annotation="")
    text = str(result.library._final_module)  # noqa: SLF001
    return _Template(empty, result, tuple(stand_ins.values()), text.encode())
