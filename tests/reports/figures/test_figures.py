"""The figures: listed, drawn without pyplot, each saying the same as the rows behind it."""

from __future__ import annotations

import io
import math
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import phongbench_reports
from phongbench.analysis.front import framed, front
from phongbench.analysis.rows import Rows, at
from phongbench.formulas import error_laws
from phongbench.results.records import Records
from phongbench_reports import figures, plots, ticks
from phongbench_reports.drawing import csv_of
from phongbench_reports.figures import FIGURES, spheres
from phongbench_reports.plots import Plate, ink
from phongbench_reports.table import Absent

PACKAGE = Path(phongbench_reports.__file__).parent


#: what several figures are made with, and figures of pictures that a run may have
SHARED = ("inverse_line", "lobe", "measured", "pictures", "scene_images", "spheres")


def test_the_list_and_the_folder_hold_the_same_figures() -> None:
    files = {path.stem for path in Path(figures.__file__).parent.glob("*.py")} - {"__init__", *SHARED}
    assert files == {figure.name for figure in FIGURES}
    assert all(figure.make.__module__ == f"phongbench_reports.figures.{figure.name}" for figure in FIGURES)


def test_every_figure_is_drawn_for_a_full_run(plates: dict[str, Plate]) -> None:
    assert list(plates) == [figure.name for figure in FIGURES]
    for plate in plates.values():
        assert plate.takeaway.endswith(".")
        assert len(plate.data)
        assert not {"nan", "None", "<NA>"} & set(f"{plate.takeaway} {plate.alt} {plate.basis}".split())


def test_pyplot_is_never_imported() -> None:
    for path in PACKAGE.rglob("*.py"):
        assert "import pyplot" not in path.read_text(encoding="utf-8")
        assert "matplotlib.pyplot" not in path.read_text(encoding="utf-8")
    program = "import sys, phongbench_reports; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_the_csv_of_a_figure_is_its_data(plates: dict[str, Plate]) -> None:
    for name, plate in plates.items():
        again = pd.read_csv(io.BytesIO(csv_of(plate.data)), keep_default_na=False, na_values=[""])
        assert list(again.columns) == list(plate.data.columns), name
        assert len(again) == len(plate.data), name
        for column in plate.data.select_dtypes("float"):
            np.testing.assert_allclose(again[column], plate.data[column], rtol=5e-6, err_msg=f"{name} {column}")


def test_a_users_matplotlibrc_does_not_show(study: Rows, plates: dict[str, Plate]) -> None:
    import matplotlib as mpl

    with ink():
        before = plots.svg_pair(plates["error_gamma"].figure, "error_gamma")
    entry = next(figure for figure in FIGURES if figure.name == "error_gamma")
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20, "svg.hashsalt": "mine", "lines.linewidth": 9}):
        with ink():
            plate = entry.make(study)
            assert isinstance(plate, Plate)
            assert plots.svg_pair(plate.figure, "error_gamma") == before
        assert mpl.rcParams["font.size"] == 20


def test_error_against_gamma_lies_on_the_law(plates: dict[str, Plate]) -> None:
    data = plates["error_gamma"].data
    for row in data[data["gamma"] >= 4].itertuples():
        assert row.law == pytest.approx(
            abs(float(error_laws.lyon_taylor(row.lambda_form, row.alpha, float(row.gamma))))
        )
        assert row.max_abs == pytest.approx(row.law, rel=0.03, abs=2e-4)
    told = plates["error_gamma"].takeaway.replace("\u00a0", " ")
    assert "α = 10: none" in told
    assert "α = 20: γ = 16" in told


def test_error_against_angle_peaks_where_the_law_says(plates: dict[str, Plate]) -> None:
    data = plates["error_angle"].data
    lyon = data[data["label"] == "lyon:dot:8"]
    worst = lyon.loc[lyon["error"].abs().idxmax()]
    assert -worst["error"] == pytest.approx(float(error_laws.lyon_taylor_dot(50.0, 8.0)), rel=0.01)
    assert 50.0 * (1 - np.cos(np.radians(worst["angle_degrees"]))) == pytest.approx(2.0, abs=0.15)  # u = 2
    assert (data["error"] == data["value"] - data["exact"]).all()


def test_the_heat_map_counts_cells_within_one_code(run: Any, plates: dict[str, Plate]) -> None:
    data = plates["heatmap"].data
    taylor = data[data["beta_policy"] == "taylor"]
    assert len(taylor) == run.accuracy["alpha"].nunique() * run.accuracy["gamma"].nunique()
    assert f"taylor: {(taylor['max_abs'] <= 1 / 255).sum()} of {len(taylor)} cells" in plates["heatmap"].takeaway


def test_stability_tells_the_slopes_of_the_law(plates: dict[str, Plate]) -> None:
    data = plates["stability"].data
    from phongbench_reports.figures.stability import slopes

    for way, form, order in (("a", "cross", 1.0), ("a", "dot", 1.0), ("opposite", "difference", 2.0)):
        found, law = slopes(data[data["perturbation"] == way])[form]
        assert found == pytest.approx(order, abs=0.1)
        assert law == pytest.approx(found, abs=0.02)
    assert "cross, by the law 1.0" in plates["stability"].takeaway
    assert data["alpha"].unique().tolist() == [128.0]


def test_meshes_show_what_raw_normals_change_in_codes(plates: dict[str, Plate]) -> None:
    data = plates["meshes"].data
    assert set(data["alpha"]) == {10.0, 128.0, 200.0}
    assert set(data["gamma"]) == {8}
    of = data.set_index(["mesh", "alpha", "lambda_form", "pair", "edge_degrees"]).sort_index()["codes_changed"]
    for form in ("dot", "difference", "cross"):
        for pair in ("classic", "lengthwise", "half"):
            assert of["torus", 128.0, form, pair].is_monotonic_increasing
        assert of["torus", 128.0, form, "half", 5.0] < of["torus", 128.0, form, "classic", 5.0]
    assert "classic R" not in plates["meshes"].takeaway
    assert "2(N·L)N−(N·N)L" in plates["meshes"].takeaway
    assert "degenerate triangles left out: 3" in plates["meshes"].basis
    assert "--probe meshes" in str(plates["meshes"].command)


def test_law_9_the_ghost_shines_fully_and_the_gate_takes_it_away(plates: dict[str, Plate]) -> None:
    data = plates["ghost"].data.set_index("angle_degrees")
    np.testing.assert_allclose(data["ungated"].to_numpy(), data["ungated"].to_numpy()[::-1], atol=1e-12)
    assert data["ungated"][180.0] == pytest.approx(1.0)
    assert (data["gated"][90.5:] == 0.0).all()  # type: ignore[misc]
    assert (data["gated"] == data["ungated"])[:89.5].all()  # type: ignore[misc]
    assert len([image for axes in plates["ghost"].figure.axes for image in axes.images]) == 2


def test_the_picture_of_the_ghost_differs_in_its_rim_only(study: Rows) -> None:
    from phongbench_reports.figures import ghost

    row = ghost.cell_of(study).iloc[0]
    with_test, without = (ghost.sphere(row, gated=gated) for gated in (True, False))
    x, y = np.meshgrid(*2 * [((np.arange(spheres.ACROSS) + 0.5) / spheres.ACROSS * 2 - 1) / spheres.RADIUS])
    radius = np.hypot(x, y)
    changed = (without != with_test).any(axis=2)
    assert not changed[radius < np.sqrt(0.5)].any()  # there R.V > 0
    assert not changed[radius > 1.0].any()
    rim = without[(radius > 0.99) & (radius < 1.0)]
    assert rim.min(axis=1).mean() > 0.5  # white: R = -V along the silhouette


def test_the_shares_of_the_split_are_parts_of_a_whole(plates: dict[str, Plate]) -> None:
    data = plates["split"].data
    shares = data[["model_share", "length_share", "rounding_share"]]
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert (shares.idxmax(axis=1).str.removesuffix("_share") == _largest(data)).all()


def _largest(data: pd.DataFrame) -> pd.Series:
    return data[["model_max", "length_max", "rounding_max"]].idxmax(axis=1).str.removesuffix("_max")


def test_the_front_keeps_exact_formulas_on_a_log_axis(plates: dict[str, Plate]) -> None:
    data = plates["front"].data
    assert "integer-power" in set(data["approximation"])
    axes = plates["front"].figure.axes[0]
    assert axes.get_xlim()[0] > 0
    assert {"on", "off", "unresolved"} >= set(data["state"])


def test_speed_shows_the_ceilings_and_no_twin(plates: dict[str, Plate]) -> None:
    names = set(plates["speed"].data["approximation"])
    assert {"copy", "triad", "dot", "phong"} <= names
    assert "aa-twin" not in names


@pytest.mark.parametrize("low", [0.0431, 0.05, 0.1, 0.9, 7.0])
@pytest.mark.parametrize("span", [1.3, 2.0, 8.0, 40.0, 300.0, 1e4, 1e7])
def test_labels_of_a_log_axis_lie_apart_and_within_it(low: float, span: float) -> None:
    letters = 27.0
    values = ticks.readable(low, low * span, letters)
    assert values
    middles = [letters * math.log(value / low) / math.log(span) for value in values]
    edges = [(m - len(f"{v:g}") / 2, m + len(f"{v:g}") / 2) for m, v in zip(middles, values, strict=True)]
    assert edges[0][0] >= 0
    assert edges[-1][1] <= letters
    assert all(left[1] < right[0] for left, right in pairwise(edges))


def test_names_beside_lines_never_overlap() -> None:
    placed = plots.spread([0.5, 0.5, 0.51, 0.99, 1.0], 0.06)
    assert np.diff(sorted(placed)).min() >= 0.06 - 1e-6
    assert max(placed) <= 1.0 + 1e-9
    assert placed[0] <= placed[1] <= placed[2] <= placed[3] <= placed[4]
    assert plots.spread([], 0.1) == []


def test_ticks_drawn_as_few_artists_look_as_before() -> None:
    with ink():
        figure, panels = plots.sheet(5.0, 2, 2, sharex=True, sharey="row")
        for index, axes in enumerate(panels):
            axes.plot([0.003, 40.0], [2e-6 * 10**index, 3.0])
            ticks.log_axis(axes.xaxis)
            ticks.log_axis(axes.yaxis, labels=5)
        panels[2].set_axis_off()
        ticks.named_ticks(panels[0].yaxis, [0.01, 1.0], minor=[0.1, 0.5])
        panels[1].grid(False, axis="x")
        panels[1].tick_params(axis="y", length=0)
        before, many = _pixels(figure), sum(len(axes.xaxis.get_minor_ticks()) for axes in panels)
        ticks.merge_ticks(figure)
        assert many > 30
        assert not any(len(axis.get_ticklocs()) for axes in panels if axes.axison for axis in (axes.xaxis, axes.yaxis))
        assert np.abs(_pixels(figure) - before).max() <= 1


@pytest.mark.parametrize("values", [(0.0, 3.27), (-0.035, 0.019), (2.2, 2.9), (1e-6, 6000.0)])
def test_names_of_axes_keep_their_place_when_ticks_are_merged(values: tuple[float, float]) -> None:
    with ink():
        figure, (axes, _) = plots.sheet(3.0, 1, 2)
        axes.set(xlim=values, ylim=values, xlabel="across", ylabel="up")
        if values[1] > 1e3:
            ticks.log_axis(axes.xaxis, labels=5)  # an end that is small beside the other: no tick beyond it
            ticks.log_axis(axes.yaxis, labels=5)
        names = [axis.label for axis in (axes.xaxis, axes.yaxis)]
        figure.draw_without_rendering()
        before = [name.get_window_extent().bounds for name in names]
        shown = [[text.get_text() for text in axis.get_ticklabels()] for axis in (axes.xaxis, axes.yaxis)]
        ticks.merge_ticks(figure)
        figure.draw_without_rendering()
        for name, place in zip(names, before, strict=True):
            assert name.get_window_extent().bounds == pytest.approx(place, abs=2.0)
        written = [text.get_text() for text in axes.texts]
        assert all(any(text in labels for labels in shown) for text in written)
        assert len(written) > 4


def test_an_axis_of_named_places_can_be_asked_about_any_other() -> None:
    """As a notebook does for the place under the mouse."""
    with ink():
        _, (axes,) = plots.sheet(3.0)
        ticks.fixed_ticks(axes.yaxis, [0.5, 1.5], ["one", "two"])
        assert [axes.yaxis.get_major_formatter().format_data_short(place) for place in (0.5, 1.5, 0.7)] == [
            "one", "two", "",
        ]  # fmt: skip


def _pixels(figure: Figure) -> Any:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="rgba", dpi=150)
    return np.frombuffer(buffer.getvalue(), np.uint8).astype(int)


def test_a_front_is_made_once_and_is_that_of_the_rows(study: Rows) -> None:
    found = study.front(study.alpha, study.precision)
    errors, times = Records.of(at(study.highlight, space="reflect")), Records.of(study.timing)
    wanted = front(errors, times, alpha=study.alpha, precision=study.precision, working_set=study.working_set)
    pd.testing.assert_frame_equal(found, framed(wanted))
    assert study.front(study.alpha, study.precision) is found


@pytest.mark.usefixtures("blank_figures")
def test_a_resolved_twin_withholds_speed_claims(made_up: Callable[..., Any], tmp_path: Path) -> None:
    run = made_up(tmp_path, alphas=(10.0, 50.0), gammas=(8, 16), precisions=("float32",))
    run.timing.loc[run.timing["approximation"] == "aa-twin", "verdict"] = "slower"
    index = phongbench_reports.build(run, tmp_path / "report")
    text = index.read_text(encoding="utf-8")
    assert "withheld" in text
    assert "certainly faster" not in text
    assert "no speed claim" in text


def test_the_causes_stand_in_the_order_of_their_size_with_both_truths(plates: dict[str, Plate]) -> None:
    data = plates["causes"].data
    assert list(dict.fromkeys(data["perturbation"])) == ["interpolated-10", "rsqrt-bits-1", "rsqrt-12"]
    assert set(data["truth"]) == {"angle", "given"}
    angle = data[data["truth"] == "angle"]
    for form in ("dot", "difference", "cross"):
        mine = angle[angle["lambda_form"] == form]
        assert f"{form} {(mine['length_max'] <= 1 / 255).sum()}" in plates["causes"].takeaway


def test_each_precision_has_its_best_gamma(plates: dict[str, Plate]) -> None:
    data = plates["widths"].data
    for _, mine in data.groupby(["lambda_form", "precision"]):
        assert mine.loc[mine["best"], "max_abs"].max() == mine["max_abs"].min()
    best = data[data["best"] & (data["lambda_form"] == "difference")].set_index("precision")
    assert f"float16 γ\u00a0=\u00a0{best.loc['float16', 'gamma']}" in plates["widths"].takeaway


def test_a_run_of_one_gamma_has_no_best_one(made_up: Callable[..., Any], tmp_path: Path) -> None:
    from phongbench_reports.figures import widths

    assert isinstance(widths.draw(Rows(made_up(tmp_path, gammas=(8,)))), Absent)
