"""Our charts beside matplotlib's: one program draws both, and words, marks and ticks stand at the same places."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure as Pixels

from phongbench.analysis.rows import Rows
from phongbench_reports import ticks
from phongbench_reports.chart import Figure, Scale
from phongbench_reports.chart.lettering import width
from phongbench_reports.chart.scale import _numbers, _round_numbers
from phongbench_reports.figures import FIGURES
from phongbench_reports.plots import Plate, ink, sheet

SVG = "{http://www.w3.org/2000/svg}"
#: figures that have all there is: keys, bars, intervals, names with hair lines, pictures, scales of both kinds
SHOWN = ("error_angle", "causes", "split", "speed", "moments", "ghost")
Place = tuple[str, float, float]


def bytes_of(figure: Any) -> bytes:
    """The figure as the SVG of whatever drew it."""
    if isinstance(figure, Figure):
        return figure.svg("")
    assert isinstance(figure, Pixels)
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg")
    return buffer.getvalue()


def words(svg: bytes) -> list[Place]:
    """Every text with its place, sorted."""
    return sorted(_words(ET.fromstring(svg)))


def _words(root: ET.Element) -> Iterator[Place]:
    rules = dict(re.findall(r"\.(\w+)\{([^}]*)\}", "".join(one.text or "" for one in root.iter(f"{SVG}style"))))
    of_group = {child: group.get("class", "") for group in root.iter(f"{SVG}g") for child in group}
    for element in root.iter(f"{SVG}text"):
        text = (element.text or "").replace("\u00a0", " ").strip()
        look = element.get("style") or rules[element.get("class") or of_group[element]]
        moved = re.search(r"(?:translate\(|rotate\(-90 )([-.\d]+) ([-.\d]+)", element.get("transform", ""))
        x, y = map(float, moved.groups() if moved else (element.get("x", "nan"), element.get("y", "nan")))
        size = float(re.search(r"(\d[.\d]*)px", look)[1])  # type: ignore[index]
        before = {"start": 0.0, "middle": 0.5, "end": 1.0}[(re.findall(r"text-anchor: *(\w+)", look) or ["start"])[0]]
        upright = "rotate(-90" in element.get("transform", "")
        yield text, x - (0.0 if upright else before * width(text, size)), y + before * width(text, size) * upright


def marks(svg: bytes) -> np.ndarray[Any, Any]:
    """Places (n, 2) of all marks; matplotlib's ticks are marks, too."""
    uses = [e for e in ET.fromstring(svg).iter(f"{SVG}use") if e.get("x") is not None]
    return np.array([[float(e.get(name, "nan")) for name in "xy"] for e in uses]).reshape(-1, 2)


@pytest.fixture(params=SHOWN)
def both(request: pytest.FixtureRequest, run: Any) -> tuple[bytes, bytes]:
    """A figure by us and by matplotlib."""
    make: Callable[[Rows], Any] = next(part.make for part in FIGURES if part.name == request.param)
    ours = make(Rows(run))
    with ink():
        theirs = make(Rows(run))
        assert isinstance(ours, Plate)
        return bytes_of(ours.figure), bytes_of(theirs.figure)


def test_words_and_marks_stand_where_matplotlib_puts_them(both: tuple[bytes, bytes]) -> None:
    ours, theirs = map(words, both)
    assert [text for text, *_ in ours] == [text for text, *_ in theirs]
    assert len(ours) > 20
    for text in {text for text, *_ in ours}:
        mine, other = (np.array([place[1:] for place in every if place[0] == text]) for every in (ours, theirs))
        away = np.abs(mine[:, None] - other[None]).max(axis=2)
        assert away.min(axis=1).max() < 1.5, text
        assert away.min(axis=0).max() < 1.5, text
    drawn, known = map(marks, both)
    for place in drawn:
        assert np.abs(known - place).max(axis=1).min() < 0.3


@pytest.mark.parametrize(("low", "high"), [(1e-7, 1), (3e-9, 8e4), (0.4, 7), (4.2, 900), (1e-3, 1), (0.11, 0.7)])
@pytest.mark.parametrize("labels", [20, 6, 5, 3, 2])
def test_ticks_of_a_logarithmic_scale(low: float, high: float, labels: int) -> None:
    scale = Scale()
    ticks.log_axis(scale, labels=labels)
    scale.limit(low, high)
    axis = Pixels().subplots().yaxis
    ticks.log_axis(axis, labels=labels)
    axis.axes.set_ylim(low, high)
    inside = [place for place in axis.get_majorticklocs() if low <= place <= high]
    assert [place for place, _ in scale.ticks(9)] == pytest.approx(inside)
    shown = [place for place in axis.get_minorticklocs() if low <= place <= high]
    if len(inside) + len(shown) > 3:  # of fewer, matplotlib takes the ticks of a linear scale
        assert set(np.log10(scale.small_ticks()).round(6)) | set(np.log10(inside).round(6)) >= set(
            np.log10(shown).round(6)
        )


@pytest.mark.parametrize(("low", "high"), [(0, 1), (-0.035, 0.019), (0, 33.3), (2.2, 2.9), (-7e3, 12.0), (0, 3.27)])
@pytest.mark.parametrize("most", [1, 3, 5, 9])
def test_ticks_of_a_linear_scale_and_their_numbers(low: float, high: float, most: int) -> None:
    locator, formatter = mpl.ticker.MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]), mpl.ticker.ScalarFormatter()
    axis = Pixels().subplots().yaxis
    axis.axes.set_ylim(low, high)
    formatter.set_axis(axis)
    wanted = [place for place in locator.tick_values(low, high) if low - 1e-9 <= place <= high + 1e-9]
    places = _round_numbers(low, high, most)
    assert places == pytest.approx(wanted, abs=1e-9)
    assert _numbers(places, [low, high]) == formatter.format_ticks(wanted)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_scales_have_the_same_room_around_what_is_drawn(*, logarithmic: bool) -> None:
    def drawn(axes: Any) -> list[float]:
        axes.set(xscale="log", yscale="log") if logarithmic else axes.barh([1, 2], [3, 4], height=0.5, color="#000000")
        axes.plot([1.0, 20.0, np.nan], [3.0, 0.5, 7.0], color="#000000")
        axes.axhline(9.0, color="#000000")
        axes.errorbar([2.0], [4.0], yerr=np.array([[1.0], [16.0]]), fmt="o", color="#000000", elinewidth=1.0)
        return [*axes.get_xlim(), *axes.get_ylim()]

    with ink():
        wanted = drawn(sheet(3.0)[1][0])
    assert drawn(sheet(3.0)[1][0]) == pytest.approx(wanted)


def test_text_is_as_wide_as_matplotlib_measures_it() -> None:
    figure = Pixels(dpi=72)
    for text in ("lyon-quadratic:dot:64", "R = 2(L·N)N−L", "α = 1000", "1.7×10⁻⁵", "0.0299", "two\nlines of text"):
        box = figure.text(0, 0, text, fontsize=50, family="DejaVu Sans").get_window_extent()
        assert width(text, 50) == pytest.approx(box.width, rel=0.04), text
