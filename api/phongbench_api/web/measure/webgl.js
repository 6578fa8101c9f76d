// A GPU by WebGL 2: a large draw that nobody sees, timed by the timer extension or, without it, by the wall.

import { Distrusted, Refused, Unusable, pause } from './devices.js';
import { COVER, ROWS, SIDE, STEP, fragment } from './programs.js';

/** Milliseconds that a timer's answer may take once the draw is done. */
const PATIENCE = 2000;
/** Readings in a row that another program's use of the GPU may spoil. */
const TRIES = 4;

/** The device, or null where there is none. */
export async function open() {
  const canvas = globalThis.OffscreenCanvas && new OffscreenCanvas(1, 1);
  const gl = canvas?.getContext('webgl2', { antialias: false, powerPreference: 'high-performance' });
  return gl ? new WebGl(gl) : null;
}

class WebGl {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.language = 'essl300';
    this.tool = 'WebGL 2';
    this.gl = gl;
    this.rows = ROWS.most;
    this.adapter = gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
    this.queries = gl.getExtension('EXT_disjoint_timer_query_webgl2');
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, SIDE, ROWS.most);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
    gl.disable(gl.DITHER);
    this.pixel = new Uint8Array(4);
  }

  /** How draws are timed. */
  get timer() {
    return this.queries ? 'timer queries' : 'wall time';
  }

  /** Times by the wall from now on; false where it did so before. */
  distrust() {
    const before = this.queries !== null;
    this.queries = null;
    return before;
  }

  /** A program that can be timed; Refused where the device refuses it. @param {string} text `highlight` */
  async compile(text) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, COVER], [gl.FRAGMENT_SHADER, fragment(text)]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    this.#present();
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Refused(gl.getProgramInfoLog(program) || 'the browser does not compile it');
    return { program, turn: gl.getUniformLocation(program, 'turn'), repeats: gl.getUniformLocation(program, 'repeats') };
  }

  /** Nanoseconds of a draw, by its timer and by the wall. @param {any} made @param {number} repeats */
  async time(made, repeats) {
    const { gl } = this;
    gl.viewport(0, 0, SIDE, this.rows);
    gl.useProgram(made.program);
    gl.uniform2f(made.turn, ...STEP);
    gl.uniform1i(made.repeats, repeats);
    for (let tries = 0; tries < TRIES; tries++) {
      const reading = await this.#draw();
      if (reading) return reading;
    }
    throw new Distrusted('other programs use the GPU all the time');
  }

  /** Gives the device back. */
  close() {
    this.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  /** A reading; null where something else had the GPU meanwhile. */
  async #draw() {
    const { gl, queries } = this;
    if (queries) gl.getParameter(queries.GPU_DISJOINT_EXT);
    this.#wait();
    const query = queries && gl.createQuery();
    const since = performance.now();
    if (queries) gl.beginQuery(queries.TIME_ELAPSED_EXT, query);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (queries) gl.endQuery(queries.TIME_ELAPSED_EXT);
    this.#wait();
    const wall = 1e6 * (performance.now() - since);
    if (!queries) return { ns: wall, wall };
    const end = performance.now() + PATIENCE;
    while (!gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE)) {
      this.#present();
      if (performance.now() > end) throw new Distrusted('its timer does not answer');
      await pause(1);
    }
    const ns = gl.getQueryParameter(query, gl.QUERY_RESULT);
    gl.deleteQuery(query);
    return gl.getParameter(queries.GPU_DISJOINT_EXT) ? null : { ns, wall };
  }

  /** Returns when everything is drawn: a pixel cannot be read before. */
  #wait() {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, this.pixel);
    this.#present();
  }

  #present() {
    if (this.gl.isContextLost()) throw new Unusable('the device was lost');
  }
}
