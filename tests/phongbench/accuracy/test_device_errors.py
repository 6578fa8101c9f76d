"""Errors on a device: the sweep's metrics of a device's values, and what Mesa's software adapter makes of formulas."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from webgpu_here import adapter_here

from phongbench.accuracy import device_errors, sweep, tables
from phongbench.accuracy.accumulators import BINS, METRICS
from phongbench.accuracy.device_values import errors_of
from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.probes.consistency import UNIT_STRATA
from phongbench.accuracy.probes.exhaustive import Domain
from phongbench.accuracy.probes.single_cells import coordinates, values
from phongbench.accuracy.sweep import Sweep, exact_values
from phongbench.compiler.lowering import FLOAT16
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.language import FLOAT16 as HALF
from phongbench.formulas.shader_code.languages import language_named
from phongbench.formulas.shader_code.measured import compiled
from phongbench.inputs.plan import Plan, preset
from phongbench.results.schema import ACCURACY, CASE, GPU
from phongbench.targets.webgpu.session import Session

ALPHA, SAMPLES = 50.0, 2000


@pytest.fixture(scope="module")
def prepared() -> Sweep:
    plan = replace(
        preset("quick"), alphas=(ALPHA,), gammas=(8,), approximations=("phong", "lyon", "gaussian"),
        slopes=("taylor",), samples=SAMPLES, timing=False, probes=(), raw=("phong/each", "lyon:cross:8@lengthwise"),
    ).validated()  # fmt: skip
    return sweep.prepare(plan)


@pytest.fixture(scope="module")
def device() -> Iterator[Session]:
    adapter_here()
    with Session() as session:
        yield session


@pytest.fixture(scope="module")
def rows(prepared: Sweep, device: Session) -> pd.DataFrame:
    return device_errors.measure(prepared, device, adapter_here(), (ALPHA,), SAMPLES, thorough=True)


@pytest.fixture(scope="module")
def here(prepared: Sweep) -> pd.DataFrame:
    """This machine's rows over the same pairs."""
    return tables.accuracy(prepared, [tables.part(list(sweep.run(prepared)))])


def test_of_a_kernels_values_it_tells_what_the_sweep_does(prepared: Sweep) -> None:
    batch = next(b for b in prepared.batches if b.stratum.name == "lengths" and b.stratum.perturbation == "both")
    a, b = batch.pairs(1, 0, 1500)
    position = batch.cells[-1]
    cell = prepared.cells[position]
    exact = exact_values(batch, ALPHA, a, b)
    given = values(REGISTRY[cell.approximation], cell, coordinates(batch.precision, a, b))
    mine = errors_of(given, exact, a, b)
    alone = replace(batch, cells=(position,), samples=1500)
    theirs = sweep._block(replace(prepared, batches=[alone]), alone, 0).errors
    for name in set(METRICS) - {"model_max", "length_max", "rounding_max"}:
        assert METRICS[name](mine) == pytest.approx(METRICS[name](theirs), rel=1e-12), name
    assert (mine.bins == theirs.bins).all()
    assert (mine.worst == theirs.worst).all()


def test_what_is_not_finite_is_counted_and_left_out() -> None:
    given = np.array([1.5, -0.5, np.nan, np.inf, 0.25], np.float32)
    exact = np.array([[1.0, 0.0, 0.5, 0.5, np.inf]])
    found = errors_of(given, exact, np.zeros((3, 5)), np.zeros((3, 5)))
    told = {name: float(METRICS[name](found)[0]) for name in METRICS}
    assert (told["nonfinite"], told["above_one"], told["negative"]) == (2, 2, 1)
    assert (told["max_abs"], told["bias"], told["max_above"], told["max_below"]) == (0.5, 0.0, 0.5, 0.5)
    assert found.bins.shape == (1, BINS)
    nothing = errors_of(given[2:3], exact[:, 2:3], np.zeros((3, 1)), np.zeros((3, 1)))
    assert METRICS["max_abs"](nothing)[0] == 0
    assert np.isnan(METRICS["mean_abs"](nothing)[0])


def test_rows_are_of_the_devices_own(rows: pd.DataFrame, prepared: Sweep) -> None:
    assert list(rows.columns) == ACCURACY.names
    assert set(rows["device"]) == {GPU}
    assert not rows.duplicated(ACCURACY.key).any()
    assert set(rows["precision"]) == {"float32", "float16"} if adapter_here().half else {"float32"}
    assert {"sampled", "searched"} <= set(rows["coverage"])
    assert {*UNIT_STRATA, "lengths", "configurations", "vectors"} <= set(rows["stratum"])
    assert rows["gated"].all()
    assert "hostile" not in set(rows["stratum"])
    assert set(rows[rows["recipe"] == "lengthwise"]["stratum"]) == {"configurations"}


def test_float32_errs_there_as_here_but_for_what_powers_may(rows: pd.DataFrame, here: pd.DataFrame) -> None:
    """The same pairs, the same truth: operations that round to nearest leave what powers and roots may be off."""
    mine = rows[(rows["precision"] == "float32") & (rows["coverage"] == "sampled")]
    key = [name for name in CASE if name != "device"]
    over_long = (mine["stratum"] == "lengths") & mine["lambda_form"].isin(["none", "dot"])  # code limits those to 1
    both = mine[~over_long].merge(here, on=key, suffixes=("", "_here"))
    assert len(both) > 60
    assert both["max_abs"].to_numpy() == pytest.approx(both["max_abs_here"].to_numpy(), abs=3e-5)
    assert both["bias"].to_numpy() == pytest.approx(both["bias_here"].to_numpy(), abs=3e-6)


def test_a_search_finds_at_least_what_samples_do(rows: pd.DataFrame) -> None:
    cell = ["approximation", "lambda_form", "gamma", "beta_policy", "space", "precision"]
    rows = rows.assign(gamma=rows["gamma"].fillna(0).astype(int))
    unit = rows[rows["stratum"].isin(UNIT_STRATA) & (rows["coverage"] == "sampled") & (rows["normalise"] == "none")]
    sampled = unit.groupby(cell)["max_abs"].max()
    searched = rows[rows["coverage"] == "searched"].set_index(cell)["max_abs"]
    both = pd.concat([sampled, searched], axis=1, keys=["sampled", "searched"]).dropna()
    assert len(both) == len(searched) > 8
    assert (both["searched"] >= both["sampled"]).all()
    assert (both["searched"] > both["sampled"]).any()


def test_no_error_is_beyond_what_a_conforming_device_may_show(rows: pd.DataFrame, prepared: Sweep) -> None:
    """Mesa's adapter keeps the accuracies of Vulkan, so the bound by contract holds of every pair of unit vectors."""
    checked = 0
    searched = rows[(rows["coverage"] == "searched") & (rows["precision"] == "float32")]
    for row in searched.to_dict("records"):
        formula = Formula.of_row(row)
        spec, setting = formula.spec(REGISTRY), formula.setting(ALPHA)
        bound = contract.largest(spec, formula, setting, sweep.precision_named("float32"), limited=True)
        assert row["max_abs"] <= bound, formula
        checked += 1
    assert checked >= 5


@pytest.mark.parametrize("name", ["lyon:dot:8", "phong", "gaussian:dot"])
def test_every_float16_cosine_is_that_of_arithmetic_that_rounds_each_operation(name: str, device: Session) -> None:
    """NumPy's float16, statement by statement: to the bit where all operations are sums and products that the device
    rounds each, or fuses; of a power or an exponential, which Mesa computes wider, within its last place.
    """
    if not adapter_here().half:
        pytest.skip("this adapter has no float16")
    formula, language = Formula.parse(name), language_named("wgsl").in_precision(HALF)
    spec, setting = formula.spec(REGISTRY), formula.setting(ALPHA)
    cosines = Domain(FLOAT16, "reflect", True, -1.0, (ALPHA,)).values
    a, b = np.zeros((len(cosines), 3), np.float16), np.zeros((len(cosines), 3), np.float16)
    a[:, 0], b[:, 0] = 1, cosines
    given = np.zeros((len(cosines), 3, 4), np.float32)
    given[:, 0, :3], given[:, 1, :3] = a, b
    text = device_errors._program(_of(formula), _of(formula).cells[0])
    (found,) = device.ask("values", texts=[text], given=given)
    made = [
        compiled(spec, formula, setting, language, limited=True, fused=fused)(a, b).astype(np.float32)
        for fused in (False, True)
    ]
    if "lyon" in name:
        assert ((found == made[0]) | (found == made[1])).all()
    else:
        last = np.spacing(np.maximum(np.abs(made[0]), 2.0**-14).astype(np.float16)).astype(np.float32)
        assert (np.abs(found - made[0]) <= 2 * last).mean() > 0.99


def _of(formula: Formula) -> Sweep:
    plan = Plan(alphas=(ALPHA,), precisions=("float16",), approximations=(formula.approximation,))
    whole = sweep.prepare(plan.validated())
    cells = [cell for cell in whole.cells if cell.formula == formula and cell.gated]
    return replace(whole, cells=cells)
