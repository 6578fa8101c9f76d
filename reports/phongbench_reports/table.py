"""A table of a report: its columns, rows and notes; or why a section has nothing to show."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from phongbench.analysis.rows import Rows


@dataclass(frozen=True)
class Table:
    """A table of the page.

    headings   tuple of str         column titles
    rows       tuple of rows        each a tuple of plain strings, as many as headings
    numeric    frozenset of int     columns that are set right-aligned
    details    tuple of rows        lines of code below each row, or empty
    code       frozenset of int     columns that are set as code
    data       DataFrame            the numbers behind it, unrounded; becomes the CSV
    takeaway   str                  one sentence computed from the rows
    basis      str                  what the rows rest on
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    data: pd.DataFrame
    takeaway: str
    basis: str = ""
    numeric: frozenset[int] = field(default_factory=frozenset)
    code: frozenset[int] = field(default_factory=frozenset)
    details: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True)
class Absent:
    """Why a section has nothing to show, and how to get it; both plain text, one sentence each."""

    reason: str
    fix: str


@dataclass(frozen=True)
class Part:
    """A section before its run is known.

    name    str        its anchor, and file name of its figure and CSV
    title   str        heading on the page
    make    function   Rows -> Plate, Table or ClaimTable; Absent where the run has no rows for it
    folded  bool       behind a fold that opens by a click
    """

    name: str
    title: str
    make: Callable[[Rows], Any]
    folded: bool = False
