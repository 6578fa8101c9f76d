"""How wide and how tall text is. Figures are laid out for DejaVu Sans, whatever font a reader's machine has."""

from collections.abc import Iterable

#: of the font size: from the baseline up and down, and the gap to the next line (the font's table OS/2)
ASCENT, DESCENT, GAP = 1556 / 2048, 492 / 2048, 410 / 2048


def width(text: str, size: float) -> float:
    """Points that the longest line takes at a font size; kerning is left out."""
    return size * max(sum(_WIDTHS.get(letter, _USUAL) for letter in line) for line in text.split("\n")) / 2048


def height(text: str, size: float) -> float:
    """Points from the top of the first line to the bottom of the last one."""
    count = text.count("\n") + 1
    return size * count * (ASCENT + DESCENT + (GAP if count > 1 else 0.0))


def baselines(text: str, size: float, vertical: str) -> list[float]:
    """How far each line's baseline lies below the place of a text.

    vertical  what of the text is there: top, center, bottom, baseline of the last line, or center_baseline between that
              and the top
    """
    count, gap = text.count("\n") + 1, GAP if "\n" in text else 0.0
    line, first = size * (ASCENT + DESCENT + gap), size * (ASCENT + gap / 2)
    last = first + (count - 1) * line
    above = {
        "top": 0.0,
        "center": count * line / 2,
        "bottom": count * line,
        "baseline": last,
        "center_baseline": last / 2,
    }
    return [first + index * line - above[vertical] for index in range(count)]


def _table(first: str, widths: Iterable[int]) -> dict[str, int]:
    return {chr(ord(first) + index): wide for index, wide in enumerate(widths)}


#: advance widths in 2048ths of the font size
_WIDTHS = {
    **_table(" ", (
        651, 821, 942, 1716, 1303, 1946, 1597, 563, 799, 799, 1024, 1716, 651, 739, 651, 690, 1303, 1303, 1303,
        1303, 1303, 1303, 1303, 1303, 1303, 1303, 690, 690, 1716, 1716, 1716, 1087, 2048, 1401, 1405, 1430,
        1577, 1294, 1178, 1587, 1540, 604, 604, 1343, 1141, 1767, 1532, 1612, 1235, 1612, 1423, 1300, 1251,
        1499, 1401, 2025, 1403, 1251, 1403, 799, 690, 799, 1716, 1024, 1024, 1255, 1300, 1126, 1300, 1260, 721,
        1300, 1298, 569, 569, 1186, 569, 1995, 1298, 1253, 1300, 1300, 842, 1067, 803, 1298, 1212, 1675, 1212,
        1212, 1075, 1303, 690, 1303, 1716,
    )),
    "α": 1350, "γ": 1212, "β": 1307, "λ": 1212, "·": 651, "×": 1716, "−": 1716, "–": 1024, "≤": 1716, "≥": 1716,
    "°": 1024, "₂": 821, "⁻": 1081, "⁰": 821, "¹": 821, "²": 821, "³": 821, "⁴": 821, "⁵": 821, "⁶": 821, "⁷": 821,
    "⁸": 821, "⁹": 821, "\u00a0": 651, "\u202f": 409, "∞": 1706,
}  # fmt: skip
_USUAL = 1255
