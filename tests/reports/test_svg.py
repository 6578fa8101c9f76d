"""A picture loses what nobody sees, and nothing else: it is drawn alike, element for element."""

import io
import re
from typing import Any
from xml.etree import ElementTree as ET

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from phongbench_reports.plots import ink, sheet
from phongbench_reports.svg import of_both, slim

SVG = "{http://www.w3.org/2000/svg}"
#: attributes that say how an element looks
Look = dict[str, str]


def drawing(svg: bytes) -> list[tuple[str, Look, str]]:
    """What a reader of the picture is shown, in order: shape, look and text, with styles resolved down the tree."""
    root = ET.fromstring(svg)
    sheet_text = "".join(one.text or "" for one in root.iter(f"{SVG}style"))
    classes = dict(re.findall(r"\.(\w+)\{([^}]*)\}", sheet_text))
    shapes = {one.get("id"): one for one in root.iter() if one.get("id")}
    found: list[tuple[str, Look, str]] = []

    def declared(element: ET.Element) -> Look:
        text = f"{classes.get(element.get('class', ''), '')};{element.get('style', '')}"
        pairs = [part.split(":", 1) for part in text.split(";") if ":" in part]
        return {key.strip(): re.sub(r"\s*,\s*", ",", value.strip()) for key, value in pairs}

    def visit(element: ET.Element, look: Look, clip: str) -> None:
        if element.tag in (f"{SVG}defs", f"{SVG}metadata"):
            return
        look = look | declared(element)
        clip = element.get("clip-path", clip)
        if element.tag in (f"{SVG}path", f"{SVG}use", f"{SVG}text", f"{SVG}image"):
            link = element.get("{http://www.w3.org/1999/xlink}href", "")
            target = shapes.get(link[1:])
            own = declared(target) if target is not None else {}
            shape = (target if target is not None else element).get("d", "")
            cut = next(iter(shapes[clip[5:-1]]), None) if clip else None
            places = [element.get(name, "") for name in ("x", "y", "width", "height")]
            turned = element.get("transform", "")
            turned = "" if turned.startswith("rotate(-0 ") else turned
            edge = sorted(cut.items()) if cut is not None else []
            shown = " ".join([element.tag, shape, *places, turned, *(v for _, v in edge)])
            found.append((shown, look | own, element.text or "" if element.tag == f"{SVG}text" else ""))
        for child in element:
            visit(child, look, clip)

    visit(root, {}, "")
    return found


def numbers(shape: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", shape)]


def letters(shape: str) -> str:
    return re.sub(r"[-\d.\s]+", "", shape)


@pytest.fixture(scope="module")
def picture() -> bytes:
    """Lines, marks, a band, a picture of numbers, texts with awkward signs, in two panels."""
    with ink():
        figure: Figure
        figure, (left, right) = sheet(3.0, 1, 2)
        left.plot([0.0, 1.0, 2.0], [1e-3, 2e-3, 1.5e-3], "o--", label="a < b & c />")
        left.axhspan(0.001, 0.0012, alpha=0.18)
        left.scatter([0.1, 0.2, 0.3, 0.4], [1e-3] * 4, marker="^")
        left.legend()
        right.imshow([[0.0, 1.0], [0.5, 0.25]], aspect="auto")
        right.vlines([0.1, 0.2, 0.3, 0.4], 0, 1)
        right.set_title("two  blanks")
        buffer = io.BytesIO()
        with mpl.rc_context({"svg.hashsalt": "test", "svg.fonttype": "none"}):
            figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def test_a_slim_picture_draws_the_same_shapes_in_the_same_looks(picture: bytes) -> None:
    before, after = drawing(picture), drawing(slim(picture))
    assert len(before) == len(after) > 50
    for (shape, look, text), (small, new, told) in zip(before, after, strict=True):
        assert letters(shape) == letters(small)
        assert numbers(small) == pytest.approx(numbers(shape), abs=0.00501)
        assert new == look
        assert told == text
    assert len(slim(picture)) < 0.6 * len(picture)


def test_slim_is_well_formed_the_same_again_and_settled(picture: bytes) -> None:
    once = slim(picture)
    assert once == slim(picture)
    assert drawing(slim(once)) == drawing(once)
    assert "a < b & c />" in [text for _, _, text in drawing(once)]
    assert "two  blanks" in [text for _, _, text in drawing(once)]


@pytest.mark.parametrize(
    ("inside", "kept"),
    [
        ('<path d="M 1.23456 -0.00012&#10;L 2 3.5"/>', '<path d="M1.23 0L2 3.5"/>'),
        ('<text x="0.5000" id="unused">0.00392</text>', '<text x="0.5">0.00392</text>'),
        ('<image transform="matrix(0.00125 0 0 1 0 0)"/>', '<image transform="matrix(0.00125 0 0 1 0 0)"/>'),
        ('<g><g id="g"><path d="M0 0"/></g></g>', '<path d="M0 0"/>'),
        ('<use href="#long-name"/><path id="long-name" d=""/>', '<use href="#a"/>\n<path d="" id="a"/>'),
    ],
)
def test_what_is_shortened(inside: str, kept: str) -> None:
    short = slim(f'<svg xmlns="http://www.w3.org/2000/svg">{inside}</svg>'.encode()).decode()
    assert short.split(">\n", 2)[2] == f"{kept}\n</svg>\n"


def test_one_picture_is_light_or_dark_as_the_screen_is(picture: bytes) -> None:
    light = slim(picture)
    dark = light.replace(b"#1b2330", b"#e4e8ee")
    both = of_both(light, dark)
    before, rules = both.split(b"@media (prefers-color-scheme:dark){")
    assert b"#1b2330" in before
    assert light.startswith(before)
    inside = rules[: rules.index(b"</style>")]
    assert b"#1b2330" not in inside
    assert inside.count(b"#e4e8ee") == dark.count(b"#e4e8ee")
    assert len(both) < 1.1 * len(light)
    assert ET.fromstring(both).tag == f"{SVG}svg"


def test_a_group_of_the_see_through_stays_single() -> None:
    """The opacity of a group is that of all its members together."""
    band: Any = '<path d="M0 0" style="opacity: 0.5"/>'
    assert slim(f'<svg xmlns="http://www.w3.org/2000/svg">{3 * band}</svg>'.encode()).count(b'class="o0"') == 3
