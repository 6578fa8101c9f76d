"""Text laid out for whoever reads it: tables, notes and commands that break between words, never inside one.

On a terminal a table has its width; where it does not fit, long cells wrap at words, and below 80 columns, or where
that is not enough either, rows stand below one another. In a pipe a row is a line, without padding at either end.
"""

import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click

#: blanks between columns; how far what belongs to a row, a note or a name is indented
GAP, INDENT = 2, 2
#: from this width on, cells wrap instead of rows being stacked
WRAPS_FROM = 80
#: what a wrapped column keeps, at least, where its text is as long
_NARROW = 18


def width_of(*, err: bool = False) -> int | None:
    """The columns of the terminal that stdout, or stderr, is; None for a pipe or a file."""
    stream = sys.stderr if err else sys.stdout
    return shutil.get_terminal_size().columns if stream.isatty() else None


def text_of(value: Any) -> str:
    """A value as people read it: four significant digits, nothing for what is missing."""
    if value is None or value != value:
        return ""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {text_of(one)}" for name, one in value.items())
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{value:,}" if abs(value) >= 10_000 else str(value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def wrapped(text: str, width: int | None, indent: int = 0) -> list[str]:
    """Its lines, broken between words where it is wider; those after the first of each are indented."""
    if width is None:
        return text.splitlines() or [""]
    lines: list[str] = []
    for line in text.splitlines() or [""]:
        first = line[: len(line) - len(line.lstrip())]
        lines += textwrap.wrap(
            line,
            max(width, 1),
            initial_indent=first,
            subsequent_indent=first + " " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        ) or [""]
    return lines


def say(text: str, *, err: bool = False) -> None:
    """Print sentences, wrapped at words on a terminal; talk goes to stderr."""
    for line in wrapped(text, width_of(err=err), INDENT):
        click.echo(line, err=err)


def command(words: str, before: str = "") -> None:
    """Print a command to be copied, after a label; where it is wider than the terminal it goes on after a backslash."""
    width = width_of()
    lines = wrapped(before + words, None if width is None else width - 2, max(len(before), INDENT))
    for line in lines[:-1]:
        click.echo(f"{line} \\")
    click.echo(lines[-1])


def facts(data: Mapping[str, Any]) -> None:
    """Print names and values below one another."""
    for line in pairs(list(data.items()), width_of()):
        click.echo(line)


def pairs(data: Sequence[tuple[str, Any]], width: int | None, indent: int = 0) -> list[str]:
    """Lines of names and values; a value that does not fit goes on below itself, or below its name."""
    label = indent + max((len(name) for name, _ in data), default=0) + GAP
    lines = []
    for name, value in data:
        head, room = f"{'':{indent}}{name}".ljust(label), None if width is None else width - label
        parts = wrapped(text_of(value), room)
        if room is not None and max(map(len, parts)) > room:  # a word that is wider still begins a line of its own
            below = wrapped(text_of(value), max((width or 0) - indent - INDENT, 1))
            lines += [f"{'':{indent}}{name}"] if name else []
            lines += [f"{'':{indent + INDENT}}{part}" for part in below]
        else:
            lines += [(head + parts[0]).rstrip(), *(f"{'':{label}}{part}" for part in parts[1:])]
    return lines


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, right: Sequence[str] = ()) -> None:
    """Print a table on stdout; columns named in `right` are aligned right."""
    cells = [[text_of(cell) for cell in row] for row in rows]
    width = width_of()
    for line in wrapped(title, width, INDENT) if title else []:
        click.echo(line)
    for line in table_lines(columns, cells, [name in right for name in columns], width):
        click.echo(line)
    if width is not None:
        click.echo()


def table_lines(
    columns: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[bool], width: int | None
) -> list[str]:
    """The lines of a table that is at most so wide, but for single words that are wider.

    columns  heads, of which the first may be empty
    rows     cells, whose lines are broken where they say so
    right    for each column whether it is aligned right
    width    columns of the terminal; None for a pipe
    """
    kept = [i for i, name in enumerate(columns) if any(row[i] for row in rows) or (name and not rows)]
    columns, right = [columns[i] for i in kept], [right[i] for i in kept]
    rows = [[row[i] for i in kept] for row in rows]
    widths = _widths(columns, rows, width)
    if widths is None:
        return [line for row in rows for line in _stacked(columns, row, width or 0)]
    lines = _row(columns, widths, right)
    if width is not None:
        lines.append("─" * _total(widths))
    for row in rows:
        lines += _row(row, widths, right)
    return lines


def _widths(columns: Sequence[str], rows: Sequence[Sequence[str]], width: int | None) -> list[int] | None:
    """How wide each column is; None where rows must be stacked."""
    texts = [[row[i] for row in rows] for i in range(len(columns))]
    natural = [max(map(_longest_line, (head, *cells))) for head, cells in zip(columns, texts, strict=True)]
    if width is None or _total(natural) <= width:
        return natural
    if width < WRAPS_FROM:
        return None
    least = [max(map(_longest_word, (head, *cells))) for head, cells in zip(columns, texts, strict=True)]
    whole = [max(map(_longest_line, ("", *cells))) for cells in texts]
    widths = [max(low, min(most, _NARROW)) for low, most in zip(least, whole, strict=True)]
    if _total(widths) > width:
        return None
    while (room := width - _total(widths)) > 0:  # to those that lack most
        lacking = [full - got for full, got in zip(natural, widths, strict=True)]
        if max(lacking) <= 0:
            break
        widths[lacking.index(max(lacking))] += min(room, max(1, max(lacking) // 8))
    return widths


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _longest_line(text: str) -> int:
    return max(map(len, text.splitlines()), default=0)


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=0)


def _row(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> list[str]:
    """The lines of a row, without blanks at their ends."""
    parts = [wrapped(cell, width) for cell, width in zip(cells, widths, strict=True)]
    lines = []
    for at in range(max(map(len, parts), default=0)):
        words = [part[at] if at < len(part) else "" for part in parts]
        aligned = [
            word.rjust(width) if end else word.ljust(width)
            for word, width, end in zip(words, widths, right, strict=True)
        ]
        lines.append((" " * GAP).join(aligned).rstrip())
    return lines


def _stacked(columns: Sequence[str], row: Sequence[str], width: int) -> list[str]:
    """A row as lines: its first cell, with its head where it is a number, then each other one after its head."""
    head, *others = row
    head = head if re.search("[A-Za-z]", head) else f"{columns[0]} {head}".rstrip()
    named = [(name, cell) for name, cell in zip(columns[1:], others, strict=True) if cell]
    return [*(wrapped(head, width, INDENT) if head else []), *pairs(named, width, INDENT)]
