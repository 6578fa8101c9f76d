"""Formulas as GLSL, ESSL and WGSL, run by the browser's own compilers, give what the kernels give."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import highlights
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.export import Options, shader
from phongbench.formulas.spec import Approximation

CASES = [
    (s.name, form, space) for s in REGISTRY.values() for form, space in itertools.product(s.lambda_forms, s.spaces)
]
#: one form of each, and every form of one; those that ESSL 1.00 has no words for: tables and the bits of floats
FEW = [case for i, case in enumerate(CASES) if case[0] == "lyon" or case[0] not in {c[0] for c in CASES[:i]}]
LACKING = ("table-x", "table-u", "bit-trick", "gaussian-quadratic")
COUNT, ALPHA = 1024, 32.0
#: draws a row of pixels, one for each pair; a highlight leaves as the four bytes of its float
WEBGL = """
([text, pairs, count]) => {
  const gl = Object.assign(document.createElement('canvas'), {width: count, height: 1}).getContext('webgl2');
  const compiled = (kind, source) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl.VERTEX_SHADER, `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`));
  gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, `#version 300 es
    ${text}
    precision highp float; precision highp int; precision highp sampler2D;
    uniform sampler2D pairs;
    out vec4 bytes;
    void main() {
      int i = int(gl_FragCoord.x);
      vec3 a = texelFetch(pairs, ivec2(i, 0), 0).xyz, b = texelFetch(pairs, ivec2(i, 1), 0).xyz;
      uint bits = floatBitsToUint(highlight(a, b));
      bytes = vec4((uvec4(bits) >> uvec4(0u, 8u, 16u, 24u)) & 255u) / 255.0;
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, count, 2, 0, gl.RGBA, gl.FLOAT, new Float32Array(pairs));
  gl.disable(gl.DITHER);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const pixels = new Uint8Array(4 * count);
  gl.readPixels(0, 0, count, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return [...new Float32Array(pixels.buffer)];
}
"""
#: the same in WebGL 1, whose shaders cannot read a float's bits: a highlight leaves as 24 bits of a share of 1
WEBGL1 = """
([text, pairs, count]) => {
  const gl = Object.assign(document.createElement('canvas'), {width: count, height: 1}).getContext('webgl');
  if (!gl.getExtension('OES_texture_float')) throw new Error('no textures of floats');
  const program = gl.createProgram();
  const attach = (kind, source) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    gl.attachShader(program, made);
  };
  attach(gl.VERTEX_SHADER, 'attribute vec2 corner; void main() { gl_Position = vec4(corner, 0.0, 1.0); }');
  attach(gl.FRAGMENT_SHADER, `
    ${text}
    precision highp float;
    uniform highp sampler2D pairs;
    void main() {
      float i = gl_FragCoord.x / ${count}.0;
      vec3 a = texture2D(pairs, vec2(i, 0.25)).xyz, b = texture2D(pairs, vec2(i, 0.75)).xyz;
      float share = floor(clamp(highlight(a, b), 0.0, 1.0) * 16777215.0);
      float high = floor(share / 65536.0), middle = floor((share - high * 65536.0) / 256.0);
      gl_FragColor = vec4(high, middle, share - high * 65536.0 - middle * 256.0, 255.0) / 255.0;
    }`);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, count, 2, 0, gl.RGBA, gl.FLOAT, new Float32Array(pairs));
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
  const corner = gl.getAttribLocation(program, 'corner');
  gl.enableVertexAttribArray(corner);
  gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
  gl.disable(gl.DITHER);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const pixels = new Uint8Array(4 * count);
  gl.readPixels(0, 0, count, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return Array.from({length: count}, (_, i) =>
    (65536 * pixels[4 * i] + 256 * pixels[4 * i + 1] + pixels[4 * i + 2]) / 16777215);
}
"""
WEBGPU = """
async ([text, pairs, count]) => {
  const device = await (await navigator.gpu.requestAdapter()).requestDevice();
  const module = device.createShaderModule({code: `
    @group(0) @binding(0) var<storage, read> pairs: array<vec4f>;
    @group(0) @binding(1) var<storage, read_write> found: array<f32>;
    ${text}
    @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
      found[id.x] = highlight(pairs[id.x].xyz, pairs[id.x + ${count}u].xyz);
    }`});
  const wrong = (await module.getCompilationInfo()).messages;
  if (wrong.length) throw new Error(wrong.map((one) => `${one.lineNum}: ${one.message}`).join('\\n'));
  const given = new Float32Array(pairs), size = 4 * count;
  const buffer = (size, usage) => device.createBuffer({size, usage});
  const [from, to, out] = [
    buffer(given.byteLength, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST),
    buffer(size, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC),
    buffer(size, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST)];
  device.queue.writeBuffer(from, 0, given);
  const pipeline = device.createComputePipeline({layout: 'auto', compute: {module, entryPoint: 'main'}});
  const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({layout: pipeline.getBindGroupLayout(0), entries: [
    {binding: 0, resource: {buffer: from}}, {binding: 1, resource: {buffer: to}}]}));
  pass.dispatchWorkgroups(count / 64);
  pass.end();
  encoder.copyBufferToBuffer(to, 0, out, 0, size);
  device.queue.submit([encoder.finish()]);
  await out.mapAsync(GPUMapMode.READ);
  const values = [...new Float32Array(out.getMappedRange())];
  device.destroy();
  return values;
}
"""


@pytest.fixture(scope="module")
def page(browser: Any) -> Iterator[Any]:
    """An empty page from localhost: WebGPU is for such pages only."""
    opened = browser.new_page()
    opened.route("http://localhost:1/", lambda route: route.fulfill(body="<html></html>", content_type="text/html"))
    opened.goto("http://localhost:1/")
    yield opened
    opened.close()


def pairs() -> tuple[Any, Any]:
    """Unit directions within a few widths of the highlight, and anywhere."""
    rng = np.random.default_rng(1)
    a = rng.normal(size=(COUNT, 3))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = a + np.where(np.arange(COUNT) % 4, 2 / np.sqrt(ALPHA), 10.0)[:, None] * rng.normal(size=(COUNT, 3))
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    return a.astype(np.float32), b.astype(np.float32)


def check(
    page: Any, spec: Approximation, form: str, space: str, language: str, program: str, precision: str = "float32"
) -> None:
    formula = Formula.of(spec.name, form, 8, spec.slopes[-1], space)
    setting = formula.setting(ALPHA)
    a, b = pairs()
    padded = np.concatenate([np.pad(v, ((0, 0), (0, 1))) for v in (a, b)])
    text = shader(formula, ALPHA, Options(language, precision)).text
    above = "precision highp float; precision highp int;" if language == "glsl" else ""
    values = page.evaluate(program, [above + "\n" + text, [float(x) for x in padded.ravel()], COUNT])
    expected = highlights(spec, form, setting, a, b, layout="aos")
    # a GPU's power may be off by some 16 roundings of its logarithm; where the bits of floats are read there are steps
    eps = 2.0**-24 if precision == "float32" else 2.0**-11
    np.testing.assert_allclose(values, expected, rtol=5e-4, atol=16 * setting.exponent * eps)


@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_glsl(page: Any, name: str, form: str, space: str) -> None:
    check(page, REGISTRY[name], form, space, "glsl", WEBGL)


@pytest.mark.parametrize(("name", "form", "space"), FEW)
def test_essl300(page: Any, name: str, form: str, space: str) -> None:
    check(page, REGISTRY[name], form, space, "essl300", WEBGL)


@pytest.mark.parametrize(("name", "form", "space"), [case for case in FEW if case[0] not in LACKING])
def test_essl100(page: Any, name: str, form: str, space: str) -> None:
    check(page, REGISTRY[name], form, space, "essl100", WEBGL1)


@pytest.mark.parametrize("language", ["essl100", "essl300"])
@pytest.mark.parametrize(("name", "form", "space"), [("phong", "none", "reflect"), ("lyon", "dot", "reflect")])
def test_mediump(page: Any, name: str, form: str, space: str, language: str) -> None:
    check(page, REGISTRY[name], form, space, language, {"essl100": WEBGL1, "essl300": WEBGL}[language], "mediump")


@pytest.mark.parametrize(("name", "form", "space"), CASES)
def test_wgsl(page: Any, name: str, form: str, space: str) -> None:
    if page.evaluate("async () => !navigator.gpu || !await navigator.gpu.requestAdapter()"):
        pytest.skip("this browser has no WebGPU")
    check(page, REGISTRY[name], form, space, "wgsl", WEBGPU)
