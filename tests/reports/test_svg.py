"""One picture for light and for dark screens."""

from xml.etree import ElementTree as ET

from phongbench_reports.chart import Figure
from phongbench_reports.svg import of_both


def test_one_picture_is_light_or_dark_as_the_screen_is() -> None:
    figure = Figure((3.0, 2.0))
    spacing = {"left": 0.1, "right": 0.9, "bottom": 0.1, "top": 0.9, "wspace": 0.0, "hspace": 0.0}
    figure.panels(1, 1, spacing=spacing)[0].set_title("dark or light")
    light = figure.svg("picture")
    dark = light.replace(b"#1b2330", b"#e4e8ee")
    both = of_both(light, dark)
    before, rules = both.split(b"@media (prefers-color-scheme:dark){")
    assert b"#1b2330" in before
    assert light.startswith(before)
    inside = rules[: rules.index(b"</style>")]
    assert b"#1b2330" not in inside
    assert inside.count(b"#e4e8ee") == dark.count(b"#e4e8ee")
    assert len(both) < 1.2 * len(light)
    assert ET.fromstring(both).tag == "{http://www.w3.org/2000/svg}svg"
