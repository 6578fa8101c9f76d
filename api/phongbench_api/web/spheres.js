// Three lit spheres: exact, approximation, and their difference, amplified. What is computed here is geometry - normals,
// the mirrored direction - and the diffuse light; highlights are looked up in the served curves.

import { $ } from './dom.js';
import { place, read, tabulated } from './lookup.js';
import { RIM } from './state.js';

const IDS = ['sphere-exact', 'sphere-value', 'sphere-error'];
const NEUTRAL = { ambient: [0.2, 0.22, 0.27], diffuse: [0.24, 0.28, 0.34], specular: [0.62, 0.62, 0.62] };
/** A room's light beside the one light, as OpenGL's own default. */
const AMBIENT_LIGHT = 0.2;
const FLAT = [38, 42, 50];
const BRIGHT = [255, 176, 0];
const DARK = [70, 160, 255];
const LARGEST = 440;
const MARGIN = 1.04;

/** The normal under a point of the unit disc. */
const normalAt = (x, y) => [x, y, Math.sqrt(Math.max(0, 1 - x * x - y * y))];

/** The light that puts the highlight at a point of the disc: the viewer's direction mirrored there. */
function lightAt(x, y) {
  const [nx, ny, nz] = normalAt(x, y);
  return [2 * nz * nx, 2 * nz * ny, 2 * nz * nz - 1];
}

/**
 * What a highlight keeps of red, green and blue. Light and viewer are far away, so V.H, the root of (1 + L.V) / 2, and
 * with it the colour is the same on the whole sphere. @param {number[][]|null} table over V.H from 0 to 1 @param {number} lz L.V
 */
function mirroredAt(table, lz) {
  if (!table) return [1, 1, 1];
  const where = Math.sqrt(Math.max(0, (1 + lz) / 2)) * (table.length - 1);
  const left = Math.min(Math.floor(where), table.length - 2);
  return table[left].map((value, c) => value + (where - left) * (table[left + 1][c] - value));
}

/** What part of the disc is shown: its middle and half width. */
function windowOf(state, reach) {
  if (!state.closeup) return { x: 0, y: 0, half: MARGIN };
  return { x: state.light[0], y: state.light[1], half: Math.min(MARGIN, Math.max(1.5 * Math.sin(reach * Math.PI / 360), 0.01)) };
}

export class Spheres {
  /**
   * @param {(patch: any) => void} set @param {() => import('./state.js').State} state
   * @param {(angle: number|null) => void} pointed told the angle between R and V under the pointer
   */
  constructor(set, state, pointed) {
    this.pointed = pointed;
    this.canvases = IDS.map($);
    this.set = set;
    this.state = state;
    this.curve = null;
    this.material = null;
    this.reflectance = null;
    this.ring = null;
    for (const canvas of this.canvases) this.#movable(canvas);
    new ResizeObserver(() => this.draw()).observe(this.canvases[0]);
  }

  /** Takes a new curve. @param {{angle: Float64Array, exact: Float64Array, value: Float64Array, error: Float64Array, reach: number}} curve */
  show(curve) {
    this.curve = curve;
    this.tables = [curve.exact, curve.value, curve.error].map((values) => tabulated(curve.angle, values));
    this.draw();
  }

  /** Draws before the next frame, once however often it is asked. */
  draw() {
    this.pending ??= requestAnimationFrame(() => { this.pending = undefined; this.#paint(); });
  }

  #paint() {
    if (!this.curve) return;
    const size = Math.max(32, Math.min(LARGEST, Math.round(this.canvases[0].clientWidth * devicePixelRatio)));
    const view = windowOf(this.state(), this.curve.reach);
    const images = this.#shaded(size, view);
    this.canvases.forEach((canvas, i) => {
      if (canvas.width !== size) canvas.width = canvas.height = size;
      const context = canvas.getContext('2d');
      context.putImageData(images[i], 0, 0);
      if (this.ring !== null) this.#circle(context, size, view, this.ring);
    });
    this.#name();
  }

  #shaded(size, view) {
    const { light, amplify } = this.state();
    const { ambient, diffuse, specular } = this.material ?? NEUTRAL;
    const [lx, ly, lz] = lightAt(...light);
    const tint = mirroredAt(this.reflectance, lz);
    const images = IDS.map(() => new ImageData(size, size));
    const [exact, value, error] = images.map((image) => image.data);
    const [ofExact, ofValue, ofError] = this.tables;
    const step = 2 * view.half / size;
    for (let row = 0, at = 0; row < size; row++) {
      const y = view.y + view.half - (row + 0.5) * step;
      for (let column = 0; column < size; column++, at += 4) {
        const x = view.x - view.half + (column + 0.5) * step;
        const r2 = x * x + y * y;
        const cover = Math.min(1, (1 - Math.sqrt(r2)) / step + 0.5);
        if (cover <= 0) continue;
        const nz = Math.sqrt(Math.max(0, 1 - r2));
        const facing = x * lx + y * ly + nz * lz;
        const mirrored = 2 * facing * nz - lz;
        const lit = facing > 0 && mirrored > 0;
        const where = lit ? place(mirrored) : 0;
        const e = lit ? read(ofExact, where) : 0;
        const v = lit ? read(ofValue, where) : 0;
        const d = lit ? read(ofError, where) : 0;
        const share = Math.min(Math.abs(d) * amplify, 1);
        const hue = d > 0 ? BRIGHT : DARK;
        for (let c = 0; c < 3; c++) {
          const matt = ambient[c] * AMBIENT_LIGHT + diffuse[c] * Math.max(facing, 0);
          exact[at + c] = 255 * (matt + specular[c] * tint[c] * e);
          value[at + c] = 255 * (matt + specular[c] * tint[c] * v);
          error[at + c] = FLAT[c] + share * (hue[c] - FLAT[c]);
        }
        exact[at + 3] = value[at + 3] = error[at + 3] = 255 * cover;
      }
    }
    return images;
  }

  /** Where the angle between R and V is the plots' cursor's: the light's cone, mirrored back onto normals. */
  #circle(context, size, view, angle) {
    const [lx, ly, lz] = lightAt(...this.state().light);
    const flat = Math.hypot(lx, ly) || 1;
    const [ux, uy] = flat === 1 && !lx ? [1, 0] : [-ly / flat, lx / flat];
    const [wx, wy, wz] = [-lz * uy, lz * ux, lx * uy - ly * ux];
    const [along, aside] = [Math.cos(angle * Math.PI / 180), Math.sin(angle * Math.PI / 180)];
    context.beginPath();
    for (let i = 0; i <= 90; i++) {
      const [c, s] = [Math.cos(i * Math.PI / 45) * aside, Math.sin(i * Math.PI / 45) * aside];
      const [x, y, z] = [along * lx + c * ux + s * wx, along * ly + c * uy + s * wy, along * lz + s * wz + 1];
      const length = Math.hypot(x, y, z) || 1;
      const at = [(x / length - view.x + view.half) / (2 * view.half) * size, (view.y + view.half - y / length) / (2 * view.half) * size];
      context.lineTo(...at);
    }
    context.strokeStyle = '#ffffffb0';
    context.lineWidth = Math.max(1, size / 320);
    context.setLineDash([size / 60, size / 80]);
    context.stroke();
    context.setLineDash([]);
  }

  #movable(canvas) {
    let from = null;
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      const view = windowOf(this.state(), this.curve?.reach ?? 90);
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map((share, i) => (i ? 1 - 2 * share : 2 * share - 1) * view.half);
    };
    const move = (event) => {
      const [x, y] = at(event);
      // In a close-up the window follows the highlight, so only the way since the last event counts.
      if (this.state().closeup) {
        const { light } = this.state();
        this.#to(light[0] + x - from[0], light[1] + y - from[1]);
        from = [x, y];
      } else this.#to(x, y);
    };
    canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); from = at(event); move(event); });
    canvas.addEventListener('pointermove', (event) => (from ? move(event) : this.pointed(this.#angle(...at(event)))));
    canvas.addEventListener('pointerleave', () => this.pointed(null));
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { from = null; });
    canvas.addEventListener('keydown', (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!way) return;
      event.preventDefault();
      const [x, y] = this.state().light;
      const step = event.shiftKey ? 0.01 : 0.05;
      this.#to(x + step * way[0], y + step * way[1]);
    });
  }

  /** The angle between R and V under a point of the window, null beside the sphere. */
  #angle(x, y) {
    const view = windowOf(this.state(), this.curve?.reach ?? 90);
    const [nx, ny, nz] = normalAt(view.x + x, view.y + y);
    const [lx, ly, lz] = lightAt(...this.state().light);
    const mirrored = 2 * (nx * lx + ny * ly + nz * lz) * nz - lz;
    return nz > 0 && mirrored >= 0 ? Math.acos(Math.min(mirrored, 1)) * 180 / Math.PI : null;
  }

  #to(x, y) {
    const far = Math.hypot(x, y) / RIM;
    this.set({ light: (far > 1 ? [x / far, y / far] : [x, y]).map((v) => Number(v.toFixed(3))) });
  }

  #name() {
    const [x, y] = this.state().light;
    const where = `highlight ${Math.abs(Math.round(100 * x))} % ${x < 0 ? 'left' : 'right'}, ${Math.abs(Math.round(100 * y))} % ${y < 0 ? 'down' : 'up'}`;
    const names = ['exact Phong', 'the approximation', 'their difference, amplified'];
    this.canvases.forEach((canvas, i) => canvas.setAttribute('aria-label', `Sphere lit with ${names[i]}; ${where}`));
  }
}
