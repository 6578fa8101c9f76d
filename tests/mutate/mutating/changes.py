"""Single changes of a source: a comparison, an operator, a constant or a condition.

Left alone are annotations, strings, what only type checkers read, and what stands inside an f-string, whose place the
parser does not tell.
"""

import ast
import copy
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

#: where something is changed: rooms that hold no compiled loop, or few, and whose own tests are no whole studies
ROOMS = ("support", "results", "inputs", "analysis", "cli", "face")
#: what shows that a source is compiled, or that the key of compiled kernels is made of it: all would compile anew
_COMPILED = (b"jit", b"intrinsics")
_COMPARISONS: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
_OPERATORS: Mapping[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True, slots=True)
class Change:
    """One change.

    room, file    of the product; the file from the checkout's root
    line          where it stands, from 1
    lines         first and last line of the statement, or of its head: what a test runs to meet the change
    names         of a statement that runs when its module is imported: what it makes or is part of; else none
    kind          comparison, operator, constant or condition
    before, after the expression, on one line
    text          the line where it begins
    start, end    of the expression in the file, in bytes
    place         of the expression in its line, in bytes after the indentation
    """

    room: str
    file: str
    line: int
    lines: tuple[int, int]
    names: tuple[str, ...]
    kind: str
    before: str
    after: str
    text: str
    start: int
    end: int
    place: int

    @property
    def name(self) -> str:
        """What tells it from all others, wherever in the file its line stands."""
        return f"{self.file}: {self.text} [{self.place}: {self.before} -> {self.after}]"

    def applied(self, source: bytes) -> bytes:
        """The source with the change; its lines keep their numbers."""
        lines = source.count(b"\n", self.start, self.end)
        return source[: self.start] + f"({self.after}{chr(10) * lines})".encode() + source[self.end :]


def drawn(root: Path, rooms: Sequence[str], seed: int) -> list[Change]:
    """Every change of these rooms, in an order drawn by the seed; an edit elsewhere moves none before another."""
    found = [
        change
        for room in rooms
        for path in sorted((root / "phongbench" / room).rglob("*.py"))
        if not is_compiled(path.read_bytes())
        for change in of_source(room, path.relative_to(root).as_posix(), path.read_bytes())
    ]
    return sorted(found, key=lambda change: hashlib.sha256(f"{seed} {change.name}".encode()).digest())


def is_compiled(source: bytes) -> bool:
    """Whether a source is compiled: changed, all kernels would compile anew."""
    return any(word in source for word in _COMPILED)


def of_source(room: str, file: str, source: bytes) -> Iterator[Change]:
    """Every change of one source."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node, place, is_condition in _expressions(ast.parse(source), _Place()):
        for kind, after in _changed(node, is_condition):
            assert node.end_lineno is not None
            assert node.end_col_offset is not None
            start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
            line = source[starts[node.lineno - 1] : starts[node.lineno]]
            column = node.col_offset - (len(line) - len(line.lstrip()))
            was, now, text = ast.unparse(node), ast.unparse(after), line.decode().strip()
            names = () if place.in_function else place.names
            yield Change(room, file, node.lineno, place.lines, names, kind, was, now, text, start, end, column)


@dataclass(frozen=True, slots=True)
class _Place:
    """Where an expression stands: see Change; whether within a function, and the class around it."""

    lines: tuple[int, int] = (1, 1)
    names: tuple[str, ...] = ()
    around: tuple[str, ...] = ()
    in_function: bool = False

    def of(self, statement: ast.stmt) -> "_Place":
        """The place of a statement here."""
        return replace(self, lines=head(statement), names=(*bound(statement), *self.around))

    def inside(self, statement: ast.stmt) -> "_Place":
        """What stands in a statement's body."""
        if isinstance(statement, FUNCTIONS):
            return replace(self, in_function=True)
        return replace(self, around=(statement.name,)) if isinstance(statement, ast.ClassDef) else self


def head(statement: ast.stmt) -> tuple[int, int]:
    """First and last line of a statement, without its body."""
    decorators: list[ast.expr] = getattr(statement, "decorator_list", [])
    body: list[ast.stmt] = getattr(statement, "body", [])
    last = max(body[0].lineno - 1, statement.lineno) if body else statement.end_lineno or statement.lineno
    return min([statement.lineno, *(one.lineno for one in decorators)]), last


def bound(statement: ast.stmt) -> list[str]:
    """The names that a statement gives a meaning."""
    if isinstance(statement, (*FUNCTIONS, ast.ClassDef)):
        return [statement.name]
    targets = getattr(statement, "targets", None) or [getattr(statement, "target", None)]
    nodes = [node for target in targets if target is not None for node in ast.walk(target)]
    return [node.id for node in nodes if isinstance(node, ast.Name)]


def _expressions(node: ast.AST, place: _Place, name: str = "") -> Iterator[tuple[ast.expr, _Place, bool]]:
    """The expressions below a node, which is its parent's member `name`: place, and if it is a condition."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.If) and _for_checkers(node.test)):
        return
    if isinstance(node, ast.stmt):
        place = place.of(node)
    if isinstance(node, ast.expr):
        yield node, place, name in ("test", "ifs")
    for member, value in ast.iter_fields(node):
        if member not in ("annotation", "returns"):
            inner = place.inside(node) if member == "body" and isinstance(node, ast.stmt) else place
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from _expressions(child, inner, member)


def _for_checkers(test: ast.expr) -> bool:
    return ast.unparse(test) in ("TYPE_CHECKING", "__name__ == '__main__'")


def _changed(node: ast.expr, is_condition: bool) -> Iterator[tuple[str, ast.expr]]:
    """What may stand for an expression, by kind."""
    if is_condition and not _told_apart_alike(node):
        yield "condition", ast.UnaryOp(ast.Not(), node)
    if isinstance(node, ast.Compare):
        for place, operator in enumerate(node.ops):
            other = copy.deepcopy(node)
            other.ops[place] = _COMPARISONS[type(operator)]()
            yield "comparison", other
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS and not (_text(node.left) or _text(node.right)):
        yield "operator", ast.BinOp(node.left, _OPERATORS[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield "operator", ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield "constant", ast.Constant(_other(node.value))


def _other(number: float) -> float:
    if isinstance(number, bool):
        return not number
    return number + 1 if number + 1 != number else 2 * number


def _text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _told_apart_alike(node: ast.expr) -> bool:
    """Whether the opposite of a comparison is among its changes already."""
    opposites = (ast.Eq, ast.NotEq, ast.In, ast.NotIn, ast.Is, ast.IsNot)
    return isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], opposites)
