// Programs in which a formula is timed: called over and over on directions that change with every call.
//
// The formula is the service's own text. A step makes each direction anew from itself, its components in turn, one of them
// multiplied by a number a hair below 1 that only the device is told: directions stay unit and the angles between them
// real, and no compiler can do the work once for all calls. That multiply-add is part of a call's time, as loads are on a CPU.

/** Calls in the body of the loop; compilers copy a table for each. */
const UNROLLED = 16;
const WITH_TABLE = 4;
/** Points in a row, and rows on which a program runs at once: more points than any GPU has lanes; few for slow devices. */
export const SIDE = 512;
export const ROWS = { most: SIDE, fewest: SIDE / 16 };
/** What a step multiplies by and adds; told to the device, not to the compiler. */
export const STEP = [1 - 2 ** -24, 1e-9];

const WORDS = {
  wgsl: { vec3: 'vec3f', variable: (type, name) => `var ${name}: ${{ vec3: 'vec3f', float: 'f32' }[type]}` },
  essl300: { vec3: 'vec3', variable: (type, name) => `${type} ${name}` },
};

/** How many directions the text's `highlight` takes. @param {string} text */
const directions = (text) => text.match(/\bhighlight\(([^)]*)\)/)[1].split(',').length;

/** Calls in the body of the loop. @param {string} text */
export const calls = (text) => (/\bTABLE\b/.test(text) ? WITH_TABLE : UNROLLED);

/** The bare dot product, which every formula begins with. @param {string} language */
export const dot = (language) => (language === 'wgsl'
  ? 'fn highlight(r: vec3f, v: vec3f) -> f32 { return dot(r, v); }'
  : 'precision highp float;\nprecision highp int;\nfloat highlight(vec3 r, vec3 v) { return dot(r, v); }');

/** Two texts of the same shape differ in numbers only, and cost the same. @param {string} text */
export const shape = (text) => text.replace(/\/\/.*$/gm, '').replace(/\b(?!1\.0\b|0\.0\b)\d+(\.\d*)?(e[-+]?\d+)?/g, '#').replace(/\s+/g, ' ');

/** The statements of a point: its directions, the loop over calls, and the sum. */
function statements(text, language) {
  const { vec3, variable } = WORDS[language];
  const names = ['a', 'b', 'c'].slice(0, directions(text));
  const begin = names.map((name, i) => `${variable('vec3', name)} = normalize(${vec3}(fract(0.3 + at * 0.618034), fract(0.7 + at * 0.754878), fract(at * 0.569840)) - ${(0.5 - 0.5 * i).toFixed(1)});`);
  // one turns its components forwards and the other backwards, so that the angle between them changes
  const turned = (name, i) => (i % 2 ? `${name} = ${vec3}(-(${name}.z * turn.x + turn.y), ${name}.x, ${name}.y);` : `${name} = ${vec3}(${name}.y, ${name}.z, -(${name}.x * turn.x + turn.y));`);
  const once = [...names.map(turned), `total += highlight(${names.join(', ')});`].join(' ');
  return [...begin, `${variable('float', 'total')} = 0.0;`,
    language === 'wgsl' ? 'for (var i = 0u; i < given.repeats; i++) {' : 'for (int i = 0; i < repeats; i++) {',
    ...Array(calls(text)).fill(once), '}'].join('\n');
}

/** A compute shader: one point a thread, its sum written down. @param {string} text `highlight` in WGSL */
export const compute = (text) => `struct Given { turn: vec2f, repeats: u32 }
@group(0) @binding(0) var<uniform> given: Given;
@group(0) @binding(1) var<storage, read_write> sums: array<f32>;
${text}
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
let at = f32(id.x);
let turn = given.turn;
${statements(text, 'wgsl')}
sums[id.x] = total;
}`;

/** A fragment shader: one point a pixel, its sum drawn. @param {string} text `highlight` in ESSL 3.00, with its precision lines */
export const fragment = (text) => `#version 300 es
${text}
uniform vec2 turn;
uniform int repeats;
out vec4 drawn;
void main() {
float at = gl_FragCoord.x + ${SIDE}.0 * gl_FragCoord.y;
${statements(text, 'essl300')}
drawn = vec4(total);
}`;

/** A triangle that covers everything. */
export const COVER = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;
