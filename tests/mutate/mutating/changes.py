"""Single changes of a source: a comparison, an operator, a constant or a condition.

Left alone are annotations, strings, what only type checkers read, and what stands inside an f-string, whose place the
parser does not tell.
"""

import ast
import copy
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

#: room -> the folders of tests that it is tried against
ROOMS: Mapping[str, tuple[str, ...]] = {
    "support": ("support", "inputs", "results"),
    "results": ("results",),
    "inputs": ("inputs",),
    "analysis": ("analysis",),
    "cli": ("cli",),
}
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


@dataclass(frozen=True, slots=True)
class Change:
    """One change.

    room, file    of the product; the file from the checkout's root
    line          where it stands, from 1
    lines         first and last line of the statement, or of its head: what a test runs to meet the change
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
    """Every change of these rooms, in an order drawn by the seed."""
    found = [
        change
        for room in rooms
        for path in sorted((root / "phongbench" / room).rglob("*.py"))
        if not is_compiled(path.read_bytes())
        for change in of_source(room, path.relative_to(root).as_posix(), path.read_bytes())
    ]
    random.Random(seed).shuffle(found)
    return found


def is_compiled(source: bytes) -> bool:
    """Whether a source is compiled: changed, all kernels would compile anew."""
    return any(word in source for word in _COMPILED)


def of_source(room: str, file: str, source: bytes) -> Iterator[Change]:
    """Every change of one source."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node, lines, is_condition in _nodes(ast.parse(source), (1, 1)):
        for kind, after in _changed(node, is_condition):
            assert node.end_lineno is not None
            assert node.end_col_offset is not None
            start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
            line = source[starts[node.lineno - 1] : starts[node.lineno]]
            place = node.col_offset - (len(line) - len(line.lstrip()))
            was, now, text = ast.unparse(node), ast.unparse(after), line.decode().strip()
            yield Change(room, file, node.lineno, lines, kind, was, now, text, start, end, place)


def _nodes(node: ast.AST, lines: tuple[int, int], name: str = "") -> Iterator[tuple[ast.expr, tuple[int, int], bool]]:
    """The expressions below a node, which is its parent's member `name`: the lines of its statement, if a condition."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.If) and _for_checkers(node.test)):
        return
    if isinstance(node, ast.stmt):
        decorators: list[ast.expr] = getattr(node, "decorator_list", [])
        body: list[ast.stmt] = getattr(node, "body", [])
        last = max(body[0].lineno - 1, node.lineno) if body else node.end_lineno or node.lineno
        lines = min([node.lineno, *(one.lineno for one in decorators)]), last
    if isinstance(node, ast.expr):
        yield node, lines, name in ("test", "ifs")
    for member, value in ast.iter_fields(node):
        if member not in ("annotation", "returns"):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from _nodes(child, lines, member)


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
