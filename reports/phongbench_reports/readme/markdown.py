"""Tables and pictures as Markdown."""

import html
from collections.abc import Iterable, Sequence
from pathlib import Path

from phongbench_reports.plots import Plate

#: where the pictures lie, seen from README.md
PICTURES = Path("reports/pictures")


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], *, right: Iterable[int] = ()) -> str:
    """A Markdown table; columns numbered in `right` are set right-aligned."""
    numeric = set(right)
    rule = ["--:" if index in numeric else "---" for index in range(len(headings))]
    lines = [headings, rule, *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def picture(name: str, plate: Plate) -> str:
    """HTML that shows the light or the dark file as the reader's page is, with its takeaway below."""
    lines = (
        "<picture>",
        f'  <source media="(prefers-color-scheme: dark)" srcset="{PICTURES}/{name}-dark.svg">',
        f'  <img alt="{html.escape(plate.alt)}" src="{PICTURES}/{name}.svg">',
        "</picture>",
    )
    return "\n".join(lines) + f"\n\n{plate.takeaway}"
