"""What commands share: types of options, where runs lie, how answers are printed."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from phongbench.cli.layout import facts, say

__all__ = [
    "DIFFERENT", "JSON", "PATH", "ROOT", "WITH", "CommaList", "ExponentList", "facts", "grid", "notes", "say", "show",
]  # fmt: skip
ROOT = Path("phongbench-runs")
#: exit code of a comparison, a verification or a question whose answer is no
DIFFERENT = 1
#: the option that every command with an answer has
JSON = click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")


PATH = click.Path(path_type=Path)
#: the option that every command that names formulas has
WITH = click.option(
    "--with", "files", multiple=True, type=PATH, metavar="FILE.py", help="Add your own formula. Repeatable."
)


class CommaList(click.ParamType[Any]):
    """Values separated by commas, as a tuple."""

    def __init__(self, name: str, member: Callable[[str], Any] = str) -> None:
        self.name, self.member = name, member

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """`10,50,200` -> (10.0, 50.0, 200.0)."""
        if not isinstance(value, str):
            return value
        words = [word.strip() for word in value.split(",") if word.strip()]
        try:
            return tuple(self.member(word) for word in words)
        except ValueError:
            self.fail(f"{value!r} is not a list of {self.name} separated by commas", param, ctx)


class ExponentList(CommaList):
    """Exponents separated by commas, as a tuple, or a range, as `Between`."""

    def __init__(self) -> None:
        super().__init__("numbers", float)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """`10,50` -> (10.0, 50.0); `20..80` -> Between(20.0, 80.0)."""
        from phongbench.inputs.plan_files import Between

        ends = value.split("..") if isinstance(value, str) else ()
        if len(ends) != 2:
            return super().convert(value, param, ctx)
        try:
            return Between(float(ends[0]), float(ends[1]))
        except ValueError:
            self.fail(f"{value!r} is not a range; write e.g. 20..80", param, ctx)


def show(data: Any, as_json: bool, *otherwise: Callable[[], Any]) -> None:
    """Print one JSON document, or call what prints the same for people; NaN and infinities are strings in it."""
    if as_json:
        from phongbench.support.strict_json import strict  # late: it needs NumPy

        click.echo(json.dumps(strict(data), indent=2, allow_nan=False))
    else:
        for print_part in otherwise:
            print_part()


def notes(sentences: Iterable[str], quiet: bool = False) -> None:
    """Print what is worth knowing and no error, on stderr."""
    for sentence in () if quiet else sentences:
        say(f"note: {sentence}", err=True)


def grid(rows: list[dict[str, Any]]) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Column names and rows of a table."""
    return tuple(rows[0]) if rows else (), [tuple(row.values()) for row in rows]
