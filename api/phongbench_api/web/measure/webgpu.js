// A GPU by WebGPU: compute passes, timed by the device's timestamps or, without those, by the wall.

import { Refused, Unusable, inTime } from './devices.js';
import { ROWS, SIDE, STEP, compute } from './programs.js';

/** The device, or null where there is none. */
export async function open() {
  const adapter = await globalThis.navigator?.gpu?.requestAdapter({ powerPreference: 'high-performance' });
  if (!adapter) return null;
  const stamps = adapter.features.has('timestamp-query');
  const device = await adapter.requestDevice({ requiredFeatures: stamps ? ['timestamp-query'] : [] });
  return new WebGpu(device, adapter.info ?? {}, stamps);
}

class WebGpu {
  /** @param {any} device @param {any} info @param {boolean} stamps */
  constructor(device, info, stamps) {
    this.language = 'wgsl';
    this.tool = 'WebGPU';
    this.adapter = info.description || [info.vendor, info.architecture, info.device].filter(Boolean).join(' ');
    this.stamps = stamps;
    this.rows = ROWS.most;
    this.device = device;
    this.gone = device.lost.then(({ message }) => { throw new Unusable(`the device was lost${message ? `: ${message}` : ''}`); });
    this.gone.catch(() => {});
    const { STORAGE, UNIFORM, COPY_DST, COPY_SRC, QUERY_RESOLVE, MAP_READ } = GPUBufferUsage;
    const buffer = (size, usage) => device.createBuffer({ size, usage });
    this.given = buffer(16, UNIFORM | COPY_DST);
    this.sums = buffer(4 * SIDE * ROWS.most, STORAGE);
    const entries = [['uniform', this.given], ['storage', this.sums]];
    this.layout = device.createBindGroupLayout({ entries: entries.map(([type], binding) => ({ binding, visibility: GPUShaderStage.COMPUTE, buffer: { type } })) });
    this.group = device.createBindGroup({ layout: this.layout, entries: entries.map(([, of], binding) => ({ binding, resource: { buffer: of } })) });
    if (!stamps) return;
    this.queries = device.createQuerySet({ type: 'timestamp', count: 2 });
    this.resolved = buffer(16, QUERY_RESOLVE | COPY_SRC);
    this.read = buffer(16, MAP_READ | COPY_DST);
  }

  /** How passes are timed. */
  get timer() {
    return this.stamps ? 'timestamps' : 'wall time';
  }

  /** Times by the wall from now on; false where it did so before. */
  distrust() {
    const before = this.stamps;
    this.stamps = false;
    return before;
  }

  /** A program that can be timed; Refused where the device refuses it. @param {string} text `highlight` */
  async compile(text) {
    const module = this.device.createShaderModule({ code: compute(text) });
    const layout = this.device.createPipelineLayout({ bindGroupLayouts: [this.layout] });
    try {
      return await this.#orGone(this.device.createComputePipelineAsync({ layout, compute: { module, entryPoint: 'main' } }));
    } catch (problem) {
      throw problem instanceof Unusable ? problem : new Refused(problem.message);
    }
  }

  /** Nanoseconds of a pass, by its timer and by the wall. @param {any} pipeline @param {number} repeats */
  async time(pipeline, repeats) {
    const { device } = this;
    const stamped = this.stamps;
    const given = new Float32Array([...STEP, 0, 0]);
    new Uint32Array(given.buffer)[2] = repeats;
    device.queue.writeBuffer(this.given, 0, given);
    await this.#orGone(device.queue.onSubmittedWorkDone());
    const encoder = device.createCommandEncoder();
    const marks = stamped ? { timestampWrites: { querySet: this.queries, beginningOfPassWriteIndex: 0, endOfPassWriteIndex: 1 } } : {};
    const pass = encoder.beginComputePass(marks);
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, this.group);
    pass.dispatchWorkgroups(SIDE * this.rows / 64);
    pass.end();
    if (stamped) {
      encoder.resolveQuerySet(this.queries, 0, 2, this.resolved, 0);
      encoder.copyBufferToBuffer(this.resolved, 0, this.read, 0, 16);
    }
    const since = performance.now();
    device.queue.submit([encoder.finish()]);
    await this.#orGone(device.queue.onSubmittedWorkDone());
    const wall = 1e6 * (performance.now() - since);
    if (!stamped) return { ns: wall, wall };
    await this.#orGone(this.read.mapAsync(GPUMapMode.READ));
    const [begin, end] = new BigInt64Array(this.read.getMappedRange());
    const ns = Number(end - begin);
    this.read.unmap();
    return { ns, wall };
  }

  /** Gives the device back. */
  close() {
    this.device.destroy();
  }

  #orGone(promise) {
    return inTime(Promise.race([promise, this.gone]));
  }
}
