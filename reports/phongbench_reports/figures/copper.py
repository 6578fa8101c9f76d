"""Copper's colour against incidence: the exact reflectance of its channels, and what approximations make of it."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from phongbench.analysis.rows import Rows
from phongbench.formulas.fresnel.reflectance import CHANNELS
from phongbench.inputs.optical_constants import COPPER, WAVELENGTHS, in_terms_of
from phongbench.support import image_files
from phongbench_reports.plots import BLUE, GREEN, INK, VERMILION, Plate, Vector, footnote, sheet
from phongbench_reports.text import listed, number
from phongbench_reports.ticks import fixed_ticks

#: angles of incidence, and how they are drawn: formula, name, dash and width
ANGLES = 181
DRAWN = (
    (COPPER.kind, "exact", "-", 1.6),
    ("f82", "f82", (0, (5, 2)), 1.2),
    ("schlick", "Schlick", (0, (1.5, 1.5)), 1.2),
    ("constant", "constant", (0, (8, 3)), 0.7),
)
INKS = dict(zip(CHANNELS, (VERMILION, GREEN, BLUE), strict=True))


def draw(study: Rows) -> Plate:
    """The channels of each formula as curves, and the colour that white light has once it is mirrored as strips."""
    degrees = np.linspace(0.0, 90.0, ANGLES)
    tables = {kind: _reflected(kind, degrees) for kind, *_ in DRAWN}
    columns = {kind: dict(zip(CHANNELS, found.T, strict=True)) for kind, found in tables.items()}
    frames = [pd.DataFrame({"reflectance": k, "incidence_degrees": degrees} | found) for k, found in columns.items()]
    data = pd.concat(frames, ignore_index=True)
    figure, (curves, strips) = sheet(3.6, 1, 2, left=0.06, right=0.98, bottom=0.2, top=0.88, wspace=0.25)
    _curves(curves, degrees, tables)
    _strips(strips, tables)
    places = listed(f"{place:g}" for place in WAVELENGTHS)
    footnote(figure, f"copper of Johnson and Christy (1972) at {places} nm; {ANGLES} angles in float64; by formula")
    return Plate(figure, data, _sentence(degrees, tables), _alt(degrees, tables), f"{ANGLES} angles, by formula")


def _reflected(kind: str, degrees: Vector) -> Vector:
    """The reflectance (n, 3) of copper by a formula; the scalar bodies run as plain Python, which is soon done."""
    fresnel = in_terms_of(COPPER, kind)
    assert fresnel is not None  # every kind drawn can tell a metal
    cosines = np.cos(np.radians(degrees)).tolist()
    return np.array([[fresnel.bound(channel)(v) for channel in range(len(CHANNELS))] for v in cosines])


def _curves(axes: Axes, degrees: Vector, tables: dict[str, Vector]) -> None:
    for kind, name, dash, width in DRAWN:
        for channel, values in zip(CHANNELS, tables[kind].T, strict=True):
            axes.plot(degrees, values, color=INKS[channel], linestyle=dash, linewidth=width)
        axes.plot([], [], color=INK, linestyle=dash, linewidth=width, label=name)
    axes.legend(loc="center left", bbox_to_anchor=(0.0, 0.6), fontsize=8, handlelength=3.2)
    for channel, place, height in zip(CHANNELS, WAVELENGTHS, tables["constant"][0], strict=True):
        axes.text(1.5, height - 0.008, f"{channel}, {place:g} nm", color=INKS[channel], fontsize=8, va="top")
    axes.set(xlim=(0.0, 90.0), ylim=(0.4, 1.02), xticks=range(0, 91, 15), xlabel="incidence (degrees)")
    axes.set_ylabel("reflectance")
    axes.set_title("channels of copper")


def _strips(axes: Axes, tables: dict[str, Vector]) -> None:
    """A strip for each formula, from 0 degrees on the left to 90 on the right."""
    strips = [image_files.codes(tables[kind][None].astype(np.float32)) for kind, *_ in DRAWN]
    axes.imshow(np.concatenate(strips), aspect="auto", extent=(0.0, 90.0, len(DRAWN), 0.0), interpolation="nearest")
    fixed_ticks(axes.yaxis, np.arange(len(DRAWN)) + 0.5, [name for _, name, *_ in DRAWN])
    axes.set_xticks(range(0, 91, 15))
    axes.grid(visible=False)
    axes.set_xlabel("incidence (degrees)")
    axes.set_title("white light, mirrored")


def _sentence(degrees: Vector, tables: dict[str, Vector]) -> str:
    exact = tables[COPPER.kind]
    front, side = exact[0], exact[np.argmin(np.abs(degrees - 85.0))]
    errors = [
        f"{name} errs by at most {number(255 * np.abs(tables[kind] - exact).max())} codes"
        for kind, name, *_ in DRAWN[1:]
    ]
    return (
        f"Copper mirrors {number(front[2] / front[0])} as much blue as red in front and {number(side[2] / side[0])} at "
        f"85°: its highlights lose their colour. Of light of full intensity, {listed(errors)}."
    )


def _alt(degrees: Vector, tables: dict[str, Vector]) -> str:
    parts = []
    for angle in (0.0, 60.0, 80.0):
        at = int(np.argmin(np.abs(degrees - angle)))
        parts.append(f"at {angle:g} degrees {', '.join(number(v) for v in tables[COPPER.kind][at])}")
    return (
        "Line chart of the reflectance of copper's red, green and blue channel against incidence, exact, by two "
        f"approximations and constant; exact: {'; '.join(parts)}; all reach 1 at 90 degrees, where the constants stay "
        "as they are. Beside it four strips of the colour that white light has once it is mirrored."
    )
