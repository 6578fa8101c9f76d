"""Measured in the page: what is timed is what is said, and what a browser or a device may do wrong is told kindly."""

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import Options, shader
from phongbench.targets import measured
from phongbench.timing import statistics

Visits = Callable[..., Any]
#: as small as a measurement may be: the processor draws here, and others use it
TINY = {"seconds": "2", "milliseconds": "2", "formulas": "3"}
DONE = "#measure-save, #measure-result .problem"
#: the page's own thread has no way to a GPU, so whatever is measured is measured beside it
NO_GPU = """
delete Navigator.prototype.gpu;
delete window.OffscreenCanvas;
"""
LOST = """
import { Unusable } from './devices.js';
export const open = async () => ({
  language: 'wgsl', adapter: 'fake', timer: 'timestamps',
  compile: async () => { throw new Unusable('the device was lost'); }, close: () => {},
});
"""
NONE = "export const open = async () => null;"


def needs_webgpu(page: Any) -> None:
    if page.evaluate("async () => !navigator.gpu || !await navigator.gpu.requestAdapter()"):
        pytest.skip("this browser has no WebGPU")


def measuring(seen: Any) -> Any:
    """The page, once its button was pressed."""
    seen.page.evaluate("(tiny) => Object.assign(document.getElementById('device').dataset, tiny)", TINY)
    seen.page.locator("#measure").click()
    return seen.page


def put(route: Any, _request: Any = None, *, body: str) -> None:
    route.fulfill(body=body, content_type="text/javascript")


def replaced(page: Any, **modules: str) -> None:
    """Put these in place of the page's own ways to a device."""
    for name, body in modules.items():
        page.context.route(f"**/measure/{name}.js", partial(put, body=body))


@pytest.mark.parametrize("way", ["WebGPU", "WebGL 2"])
def test_a_measurement_joins_the_front_and_is_a_target_once_added(
    visit: Visits, server: str, tmp_path: Path, way: str
) -> None:
    from axe_core_python.sync_playwright import Axe

    seen = visit(server + "/#lambda=dot&beta=taylor")
    if way == "WebGPU":
        needs_webgpu(seen.page)
    seen.page.evaluate(NO_GPU)
    if way == "WebGL 2":
        replaced(seen.page, webgpu=LOST)
    page = measuring(seen)
    page.wait_for_selector(DONE)
    told = page.locator("#measure-result").inner_text()
    assert f"by {way}, " in told, told
    assert "not a GPU" in told
    assert ("Tried before: WebGPU: the device was lost" in told) == (way == "WebGL 2")
    with page.expect_download() as saved:
        page.locator("#measure-save").click()
    file = tmp_path / saved.value.suggested_filename
    saved.value.save_as(file)
    table, _ = measured.add(file, tmp_path)
    assert file.stem == table.name
    rows = {row["formula"]: row for row in json.loads(file.read_text())["rows"]}
    assert list(rows)[:2] == ["phong", "lyon:dot:8"]
    assert len(rows) == 4
    seen.idle()
    assert page.locator("#target").input_value() == table.name
    assert table.name in page.locator("#front-basis").inner_text()
    page.locator("#front-details summary").click()
    shown = page.locator("#front-details tbody").inner_text()
    assert all(name in shown for name in rows)
    assert f"on {table.name}" in page.locator("#choice").inner_text()
    found = Axe().run(page, "#device")["violations"]
    assert [v["id"] for v in found if v["impact"] in ("serious", "critical")] == []


def test_without_a_device_the_page_says_so(visit: Visits, empty_server: str) -> None:
    seen = visit(empty_server + "/")
    replaced(seen.page, webgpu=NONE, webgl=NONE)
    page = measuring(seen)
    page.wait_for_selector(DONE)
    assert "neither WebGPU nor WebGL 2" in page.locator("#measure-result").inner_text()
    assert page.locator("#measure").is_enabled()
    replaced(page, webgpu=LOST)
    page.locator("#measure").click()
    page.wait_for_selector('#measure-result:has-text("lost")')
    assert "could not be measured. WebGPU: the device was lost" in page.locator("#measure-result").inner_text()


def test_a_measurement_is_cancelled_at_once_and_leaves_nothing(visit: Visits, empty_server: str) -> None:
    page = measuring(seen := visit(empty_server + "/"))
    page.locator("#measure-cancel").click()
    assert "Cancelled" in page.locator("#measure-result").inner_text()
    assert page.locator("#measure").is_enabled()
    assert page.locator("#target option").filter(has_text="page-").count() == 0
    seen.idle()


@pytest.fixture(scope="module")
def modules(browser: Any, empty_server: str) -> Iterator[Any]:
    """A page whose modules can be imported one by one."""
    page = browser.new_page()
    page.goto(empty_server + "/docs")
    yield page
    page.close()


#: a device of known costs: a pass takes 1 ms and its calls, each `ns`; `clock` is what its own timer makes of that
FAKE = """
async ([costs, seconds]) => {
  const clock = CLOCK;
  const { measure } = await import('/web/measure/rounds.js');
  const { ROWS, SIDE, calls } = await import('/web/measure/programs.js');
  let own = true, tick = 0;
  const device = {
    rows: ROWS.most,
    distrust: () => { const before = own; own = false; return before; },
    time: async (ns, repeats) => {
      const wall = 1e6 + ns * repeats * calls('') * SIDE * device.rows;
      tick += 1;
      return { wall, ns: own ? clock(wall, tick) : wall };
    },
  };
  const programs = costs.map((made, i) => ({ name: `${i}`, text: '', made }));
  try {
    return await measure(device, programs, { seconds, milliseconds: 20 }, () => {});
  } catch (problem) {
    return { problem: problem.message };
  }
}
"""
COSTS = [0.4, 0.1, 0.0002, 40.0]


@pytest.mark.parametrize(
    ("clock", "why"),
    [
        ("(wall) => wall", None),
        ("(wall) => 1e5 * Math.round(wall / 1e5)", None),
        ("() => 0", "stands still"),
        ("(wall) => -wall", "stands still"),
        ("(wall) => NaN", "stands still"),
        ("(wall) => wall / 52", "times as fast"),
        ("(wall, tick) => tick % 2 ? wall : 2e9", ""),
        ("(wall, tick) => tick < 40 ? wall : 1e9 - wall", "no more time"),
    ],
    ids=["exact", "coarse", "still", "backwards", "nothing", "ticks", "jumps", "turns back"],
)
def test_costs_are_those_of_the_calls_alone_or_the_clock_is_not_believed(
    modules: Any, clock: str, why: str | None
) -> None:
    found = modules.evaluate(FAKE.replace("CLOCK", clock), [COSTS, 0.05])
    assert "problem" not in found, found
    assert len(found["rounds"][0]) >= statistics.MIN_ROUNDS
    tolerance = 1e-6 if why or "round" not in clock else 0.05
    for cost, rounds in zip(COSTS, found["rounds"], strict=True):
        assert rounds == pytest.approx([cost] * len(rounds), rel=tolerance)
    assert found["why"] is None if why is None else why in found["why"]


def test_a_device_that_no_clock_can_time_is_refused(modules: Any) -> None:
    assert "no more time" in modules.evaluate(FAKE.replace("CLOCK", "(wall) => wall"), [[0.0, 0.0], 0.05])["problem"]


#: a device, what happens to it, and what is then said of the next reading
SPOILT = """
async (way) => {
  const { open } = await import(`/web/measure/${way}.js`);
  const { dot } = await import('/web/measure/programs.js');
  const device = await open();
  const made = await device.compile(dot(device.language));
  device.rows = 1;
  const reading = await device.time(made, 1);
  SPOIL
  const then = await device.time(made, 1).then(() => 'timed', (problem) => problem.message);
  return [reading.ns > 0 && reading.wall > 0, then];
}
"""
DISJOINT = """
  device.queries = { TIME_ELAPSED_EXT: 1, GPU_DISJOINT_EXT: 2 };
  Object.assign(device.gl, {
    createQuery: () => ({}), deleteQuery: () => {}, beginQuery: () => {}, endQuery: () => {},
    getQueryParameter: () => 5, getParameter: (name) => name === 2,
  });
"""


@pytest.mark.parametrize(
    ("way", "spoil", "told"),
    [
        ("webgpu", "device.device.destroy();", "the device was lost"),
        ("webgl", "device.gl.getExtension('WEBGL_lose_context').loseContext();", "the device was lost"),
        ("webgl", DISJOINT, "other programs use the GPU"),
        ("webgl", DISJOINT + "device.distrust();", "timed"),
    ],
    ids=["WebGPU lost", "WebGL lost", "disjoint", "by the wall"],
)
def test_a_device_that_is_spoilt_is_told(modules: Any, way: str, spoil: str, told: str) -> None:
    if way == "webgpu":
        needs_webgpu(modules)
    first, then = modules.evaluate(SPOILT.replace("SPOIL\n", spoil + "\n"), way)
    assert first
    assert told in then


def test_intervals_are_those_of_the_studies(modules: Any) -> None:
    rng = np.random.default_rng(3)
    samples = [np.exp(rng.normal(size=(2, count))) * [[scale], [1.0]] for count in (8, 9, 24, 41) for scale in (1, 9)]
    script = """
    async (samples) => {
      const { median, ratio, signTestRank, verdict } = await import('/web/measure/statistics.js');
      const one = ([times, baseline]) => {
        const { middle, low, high } = ratio(times, baseline);
        return [middle, low, high, verdict({ middle, low, high }), median(times)];
      };
      return [Array.from({ length: 80 }, (_, n) => signTestRank(n)), samples.map(one)];
    }
    """
    ranks, found = modules.evaluate(script, [sample.tolist() for sample in samples])
    assert ranks == [statistics.sign_test_rank(n) for n in range(80)]
    for (times, baseline), (middle, low, high, verdict, median) in zip(samples, found, strict=True):
        expected = statistics.ratio(times, baseline)
        assert (middle, low, high) == pytest.approx((expected.middle, expected.low, expected.high))
        assert verdict == statistics.verdict(expected)
        assert median == pytest.approx(np.median(times))


#: runs a program on its first points and reads the sums that it keeps
SUMS = """
async ([text, repeats, count]) => {
  const { STEP, compute } = await import('/web/measure/programs.js');
  const device = await (await navigator.gpu.requestAdapter()).requestDevice();
  const module = device.createShaderModule({ code: compute(text) });
  const pipeline = device.createComputePipeline({ layout: 'auto', compute: { module, entryPoint: 'main' } });
  const buffer = (size, usage) => device.createBuffer({ size, usage });
  const given = buffer(16, GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST);
  const sums = buffer(4 * count, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC);
  const out = buffer(4 * count, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST);
  const words = new Float32Array([...STEP, 0, 0]);
  new Uint32Array(words.buffer)[2] = repeats;
  device.queue.writeBuffer(given, 0, words);
  const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries: [
    { binding: 0, resource: { buffer: given } }, { binding: 1, resource: { buffer: sums } }] }));
  pass.dispatchWorkgroups(count / 64);
  pass.end();
  encoder.copyBufferToBuffer(sums, 0, out, 0, 4 * count);
  device.queue.submit([encoder.finish()]);
  await out.mapAsync(GPUMapMode.READ);
  const values = [...new Float32Array(out.getMappedRange())];
  device.destroy();
  return values;
}
"""


def walked(count: int, calls: int) -> Iterator[tuple[Any, Any]]:
    """The directions of every call, written down from what `programs.js` says of its steps."""
    at = np.arange(count, dtype=np.float32)
    offsets = [(0.3, 0.618034), (0.7, 0.754878), (0.0, 0.56984)]
    start = np.stack([np.float32(o) + at * np.float32(f) for o, f in offsets], axis=1)
    start -= np.floor(start)
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (start - np.float32(0.5), start))
    for _ in range(calls):
        a, b = np.stack([a[:, 1], a[:, 2], -a[:, 0]], axis=1), np.stack([-b[:, 2], b[:, 0], b[:, 1]], axis=1)
        yield a, b


@pytest.mark.parametrize("spelling", ["phong", "lyon:cross:8"])
def test_every_call_is_a_highlight_of_unit_directions_at_changing_angles(modules: Any, spelling: str) -> None:
    formula, count, repeats = Formula.parse(spelling), 128, 2
    needs_webgpu(modules)
    text = shader(formula, 10.0, Options("wgsl")).text
    spec, form = REGISTRY[formula.approximation], formula.lambda_form
    each = [highlights(spec, form, formula.setting(10.0), a, b, layout="aos") for a, b in walked(count, 16 * repeats)]
    assert len({round(float(np.sum(one)), 3) for one in each}) >= 3, "all angles are the same"
    found = modules.evaluate(SUMS, [text, repeats, count])
    np.testing.assert_allclose(found, np.sum(each, axis=0), rtol=2e-4, atol=2e-4)
