"""Tables and pictures as Markdown."""

import html
import re
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


def slim(svg: bytes) -> bytes:
    """The picture with coordinates of two digits after the point, which no eye tells apart, and each tag on a line."""

    def shortened(tag: re.Match[str]) -> str:
        short = re.sub(r"-?\d+\.\d{3,}", lambda n: f"{float(n[0]):.2f}".rstrip("0").rstrip("."), tag[0])
        return re.sub(r"\s*\n\s*", " ", short)

    return re.sub(r"<[^!?][^>]*>", shortened, svg.decode("utf-8")).encode("utf-8")
