"""The notebook reports/docs/tour.ipynb: its cells, run in this process one after the other, with what they show.

No kernel is needed for that: a cell is executed, what it prints is kept, and the value of its last line is shown as a
notebook would show it, as a picture, as HTML or as text.
"""

import ast
import base64
import contextlib
import io
import json
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

_TEXT = Path(__file__).parents[1] / "templates" / "tour.md"
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def cells() -> list[tuple[str, str]]:
    """The cells in order, as (kind, text): what is fenced in templates/tour.md is code."""
    parts = _BLOCK.split(_TEXT.read_text(encoding="utf-8"))  # text and code by turns
    kinds = ("markdown", "code")
    return [(kinds[index % 2], part.strip()) for index, part in enumerate(parts) if part.strip()]


def executed(folder: Path) -> list[list[dict[str, Any]]]:
    """The outputs of every code cell, run in this folder; what a cell raises is raised."""
    names: dict[str, Any] = {}
    with _inside(folder):
        return [_outputs(text, names) for kind, text in cells() if kind == "code"]


def notebook(outputs: Sequence[list[dict[str, Any]]]) -> bytes:
    """The notebook, format 4.5, with the outputs of its code cells."""
    left = iter(outputs)
    made: list[dict[str, Any]] = []
    for index, (kind, text) in enumerate(cells()):
        cell: dict[str, Any] = {
            "cell_type": kind,
            "id": f"cell-{index}",
            "metadata": {},
            "source": text.splitlines(keepends=True),
        }
        if kind == "code":
            cell |= {"execution_count": None, "outputs": next(left)}
        made.append(cell)
    python = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": python, "language_info": {"name": "python"}}
    document = {"cells": made, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}
    return (json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True) + "\n").encode()


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _outputs(text: str, names: dict[str, Any]) -> list[dict[str, Any]]:
    """What a cell prints, and what its last line is worth."""
    tree = ast.parse(text)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        exec(compile(tree, "tour", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "tour", "eval"), names)
    shown: list[dict[str, Any]] = []
    if printed.getvalue():
        shown.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)})
    if value is not None:
        shown.append({"output_type": "display_data", "metadata": {}, "data": _shown(value)})
    return shown


def _shown(value: Any) -> dict[str, Any]:
    if isinstance(value, Axes):
        picture = io.BytesIO()
        figure: Any = value.figure
        figure.savefig(picture, format="png", dpi=90, metadata={"Software": None})
        return {"image/png": base64.b64encode(picture.getvalue()).decode("ascii"), "text/plain": ["a front"]}
    html = value._repr_html_() if hasattr(value, "_repr_html_") else None
    text = {"text/plain": [repr(value) if html is None else f"a {type(value).__name__}"]}
    return text if html is None else text | {"text/html": html.splitlines(keepends=True)}
