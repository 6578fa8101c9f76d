"""SVG without what nobody can see: matplotlib writes each style at each mark, six decimals, and ids that nothing names.

A report has forty files of it, and a repository keeps every version of the README's.
"""

import re
from collections.abc import Iterator
from itertools import count, groupby
from xml.etree import ElementTree as ET

_SVG, _LINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
_TEXTS = {f"{{{_SVG}}}{name}" for name in ("text", "tspan", "title", "style")}
_GROUP, _DEFS, _METADATA, _STYLE = (f"{{{_SVG}}}{name}" for name in ("g", "defs", "metadata", "style"))
#: a name of another element, in a link or in an attribute
_NAMED = re.compile(r"(?<=#)[\w-]+(?=\)|$)")
#: attributes whose numbers are places in points of 1/72 inch
_PLACES = ("d", "x", "y", "width", "height", "points", "transform")
#: attributes that a group can have for its members
_LOOK = ("class", "clip-path")
_LONG = re.compile(r"-?\d+\.\d{3,}(?:e[-+]?\d+)?")
_AROUND_LETTERS = re.compile(r"\s*([A-Za-z])\s*")

ET.register_namespace("", _SVG)
ET.register_namespace("xlink", _LINK)


def slim(svg: bytes) -> bytes:
    """The same picture: places in hundredths of a point, each style once as a class, an element on each line.

    svg  well-formed, as matplotlib writes it. Elements keep their order; texts keep every blank.
    """
    root = ET.fromstring(svg)
    names = _new_names(root)
    classes: dict[str, str] = {}
    _clean(root, names, classes)
    sheet = root.find(f".//{_STYLE}")
    if classes and sheet is not None:
        rules = "".join(f"\n.{name}{{{style}}}" for style, name in classes.items())
        # matplotlib's first rule is one for everything: members of a group would not take the group's
        sheet.text = f"{(sheet.text or '').replace('*', 'svg', 1)}{rules}\n"
    # within texts and values the sign that ends a tag is written &gt;
    text: bytes = ET.tostring(root, encoding="utf-8").replace(b" />", b"/>")
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + text + b"\n"


def of_both(light: bytes, dark: bytes) -> bytes:
    """One slim picture that is light or dark as the reader's screen is, of two that differ in their style sheets only.

    Safari shows it light on every screen: where there is room for two files, two are better.
    """
    start, end = b"<style", b"</style>"
    usual, other = (one[one.index(start) : one.index(end)].splitlines() for one in (light, dark))
    rules = b"".join(theirs for ours, theirs in zip(usual, other, strict=True) if ours != theirs)
    return light.replace(end, b"@media (prefers-color-scheme:dark){" + rules + b"}\n" + end, 1)


def _new_names(root: ET.Element) -> dict[str, str]:
    """Old id -> short id, for those that something names."""
    named = {
        name
        for element in root.iter()
        for key, value in element.items()
        if "#" in value and key != "style"
        for name in _NAMED.findall(value)
    }
    short = _short_names()
    return {element.get("id", ""): next(short) for element in root.iter() if element.get("id") in named}


def _short_names() -> Iterator[str]:
    for index in count():
        yield f"{chr(ord('a') + index % 26)}{index // 26 or ''}"


def _clean(element: ET.Element, names: dict[str, str], classes: dict[str, str]) -> None:
    """Shortens an element and all within it."""
    _shorten(element, names, classes)
    if element.tag in _TEXTS:
        return
    element.text = "\n" if len(element) else None
    kept: list[ET.Element] = []
    for child in element:
        if child.tag == _METADATA:
            continue
        _clean(child, names, classes)
        if child.tag not in (_GROUP, _DEFS) or (len(child) and (child.attrib or child.tag == _DEFS)):
            kept.append(child)
        elif not child.attrib:
            kept += list(child)  # a group of nothing but its members
    element[:] = _grouped(kept)
    for child in element:
        child.tail = "\n"


def _grouped(elements: list[ET.Element]) -> Iterator[ET.Element]:
    """Neighbours of one look in a group that has it, where that is shorter."""
    for look, members in groupby(elements, key=_look):
        alike = list(members)
        if not look or len(alike) < 3 or look.get("class", "").startswith("o"):
            yield from alike
            continue
        group = ET.Element(_GROUP, look)
        group.text = group.tail = "\n"
        for one in alike:
            one.tail = "\n"
            for key in look:
                del one.attrib[key]
        group.extend(alike)
        yield group


def _look(element: ET.Element) -> dict[str, str]:
    return {key: element.attrib[key] for key in _LOOK if key in element.attrib}


def _shorten(element: ET.Element, names: dict[str, str], classes: dict[str, str]) -> None:
    attributes = element.attrib
    name = attributes.pop("id", None)
    if name in names:
        element.set("id", names[name])
    style = attributes.pop("style", None)
    if style:
        plain = re.sub(r"\s*([:;,])\s*", r"\1", style)
        # the opacity of a group would be that of all its members together: `_grouped` knows it by its name
        kind = "o" if "opacity" in plain else "s"
        element.set("class", classes.setdefault(plain, f"{kind}{len(classes)}"))
    if attributes.get("transform", "").startswith("rotate(-0 "):
        del attributes["transform"]  # matplotlib's for every text that lies
    for key, value in attributes.items():
        if "#" in value:
            attributes[key] = _NAMED.sub(lambda name: names.get(name[0], name[0]), value)
        elif key in _PLACES and not ("scale" in value or "matrix" in value):  # factors need their digits
            short = _LONG.sub(_two_digits, value)
            attributes[key] = _AROUND_LETTERS.sub(r"\1", short).strip() if key == "d" else short


def _two_digits(number: re.Match[str]) -> str:
    return f"{round(float(number[0]), 2) + 0.0:.2f}".rstrip("0").rstrip(".")
