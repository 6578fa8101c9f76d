"""The pictures of the README: lit spheres by exact Phong and by an approximation, and the explorer in a browser."""

import io
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from phongbench.errors import InputError
from phongbench.formulas.curves import against_exact
from phongbench.formulas.formula import Formula
from phongbench_reports.figures.spheres import ACROSS, RADIUS, Highlight, show, sphere
from phongbench_reports.plots import Vector, ink, sheet
from phongbench_reports.text import number

#: where they lie, seen from README.md
PICTURES = Path("reports/pictures")
#: what the spheres compare
FORMULA, ALPHA = "lyon:dot:8:minimax", 10.0
COSINES = np.linspace(0.0, 1.0, 4097)
#: what Chromium is called, and the size of its window
BROWSERS, WINDOW = ("chromium", "chromium-browser", "google-chrome"), (1200, 860)
SPHERES, EXPLORER = "spheres.png", "explorer.webp"


def part() -> str:
    """Both pictures with what they show, as Markdown."""
    alts = (
        f"Two spheres with a highlight that look alike, by exact Phong and by {FORMULA}, and their difference in codes",
        "The explorer page: sliders, curves, and the front of a study",
    )
    lines = [f'<img alt="{alt}" src="{PICTURES}/{name}">' for alt, name in zip(alts, (SPHERES, EXPLORER), strict=True)]
    return f"{lines[0]}\nBelow, the page that `phongbench serve` gives.\n{lines[1]}"


def spheres() -> bytes:
    """Exact Phong, the approximation, and their difference in codes, as PNG."""
    with ink():
        figure, panels = sheet(3.1, 1, 3, left=0.01, right=0.9, top=0.88, bottom=0.03, wspace=0.05)
        show(panels[0], sphere(_highlight(1)), f"exact Phong, alpha {ALPHA:g}")
        show(panels[1], sphere(_highlight(0)), FORMULA)
        codes = _difference()
        most = float(np.nanmax(np.abs(codes)))
        shades = panels[2].imshow(codes, cmap="RdBu_r", vmin=-most, vmax=most, interpolation="nearest")
        panels[2].set_axis_off()
        panels[2].set_title(f"difference: at most {number(most, 2)} codes", loc="center")
        bar = figure.colorbar(shades, cax=figure.add_axes((0.912, 0.08, 0.013, 0.75)))
        bar.set_label("codes of 255, too bright is red", fontsize=8)
        drawn = io.BytesIO()
        figure.savefig(drawn, format="png", dpi=110, pil_kwargs={"optimize": True})
        return drawn.getvalue()


@cache
def _curves() -> tuple[Vector, Vector]:
    """The approximation and exact Phong at COSINES."""
    formula = Formula.parse(FORMULA)
    degrees = np.degrees(np.arccos(COSINES))
    return against_exact(formula.spec(), formula.lambda_form, formula.setting(ALPHA), degrees)


def _highlight(which: int) -> Highlight:
    """The approximation (0) or exact Phong (1) over (N.V)^2, between cosines so near that a picture shows no finer."""
    values = _curves()[which]
    return lambda facing_squared: np.interp(2.0 * facing_squared - 1.0, COSINES, values, left=0.0)


def _difference() -> Vector:
    """Approximation minus exact in codes of 255, NaN beside the sphere."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, ACROSS) / RADIUS])
    squared = 1.0 - x * x - y * y
    difference = 255.0 * (_highlight(0)(squared) - _highlight(1)(squared))
    return np.where(squared > 0.0, difference, np.nan)


def explorer(runs: Path) -> bytes:
    """The explorer page over the newest of these runs, as WebP; InputError without a browser."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise InputError("no browser draws the explorer", ", ".join(BROWSERS), "install Chromium")
    from playwright.sync_api import sync_playwright

    words = [sys.executable, "-m", "phongbench", "serve", "--port", "0", "--runs", str(runs)]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]})
            page.set_default_timeout(300_000)
            page.goto(_address(server))
            page.wait_for_selector('#main[aria-busy="false"]')
            shot = page.screenshot()
            browser.close()
        finally:
            server.terminate()
    small = io.BytesIO()
    Image.open(io.BytesIO(shot)).convert("RGB").save(small, format="WEBP", quality=82, method=6)
    return small.getvalue()


def _address(server: Any) -> str:
    """What the server serves, once its kernels are warm."""
    url = ""
    for line in server.stderr:
        if "serves " in line:
            url = line.split("serves ")[1].split(" ")[0]
        if "ready" in line:
            return str(url)
    raise InputError("the server ended before it was ready", "phongbench serve", "run it by hand and see why")
