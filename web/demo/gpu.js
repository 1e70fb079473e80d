// What the page runs on the GPU: moves boxes, searches them in one of three ways, counts partners, and draws.
import { GpuFinder } from '../webgpu.js';
import { shaders } from '../shaders.js';
import { paperCells } from './scene.js';

const firstCapacity = 1 << 16;
const stages = ['move', 'grid', 'search', 'draw'];
// Of a dispatch, at most 65,535 along a dimension.
function dispatch(pass, groups) {
  const width = Math.min(groups, 65535);
  pass.dispatchWorkgroups(width, width ? Math.ceil(groups / width) : 0);
}

/** Times of the stages of a frame in milliseconds; none where the device cannot measure them. */
class Timer {
  #queries;
  #resolved;
  constructor(device) {
    if (!device.features.has('timestamp-query')) return;
    this.#queries = device.createQuerySet({ type: 'timestamp', count: 2 * stages.length });
    this.#resolved = device.createBuffer({ size: 16 * stages.length, usage: GPUBufferUsage.QUERY_RESOLVE | GPUBufferUsage.COPY_SRC });
  }
  writes(stage) {
    const at = 2 * stages.indexOf(stage);
    if (!this.#queries) return {};
    return { timestampWrites: { querySet: this.#queries, beginningOfPassWriteIndex: at, endOfPassWriteIndex: at + 1 } };
  }
  resolve(encoder, target, offset) {
    if (!this.#queries) return;
    encoder.resolveQuerySet(this.#queries, 0, 2 * stages.length, this.#resolved, 0);
    encoder.copyBufferToBuffer(this.#resolved, 0, target, offset, 16 * stages.length);
  }
  read(words, ran) {
    if (!this.#queries) return {};
    const times = {};
    for (const [k, stage] of stages.entries()) {
      if (ran.includes(stage)) times[stage] = Number(words[2 * k + 1] - words[2 * k]) / 1e6;
    }
    return times;
  }
}

export class GpuWorld {
  static async create(device, canvas) {
    const world = new GpuWorld();
    world.device = device;
    world.canvas = canvas;
    world.context = canvas.getContext('webgpu');
    world.format = navigator.gpu.getPreferredCanvasFormat();
    world.context.configure({ device, format: world.format, alphaMode: 'opaque' });
    const texts = {};
    await Promise.all(
      ['move_boxes', 'count_partners', 'draw_boxes', 'paper_grid'].map(async (name) => {
        const response = await fetch(new URL(`wgsl/${name}.wgsl`, import.meta.url));
        if (!response.ok) throw new Error(`${response.url}: HTTP ${response.status}`);
        texts[name] = await response.text();
      }),
    );
    const compute = (code, entryPoint) =>
      device.createComputePipelineAsync({ label: entryPoint, layout: 'auto', compute: { module: device.createShaderModule({ code }), entryPoint } });
    const before = ['parameters', 'ordered_keys', 'records', 'read_box', 'pair_index', 'pair_output'].map((name) => shaders[name]);
    const paper = [...before, texts.paper_grid].join('\n');
    const counts = `${shaders.parameters}\n${shaders.write_counts}`;
    const module = device.createShaderModule({ code: texts.draw_boxes });
    const pipelines = {
      move: compute(texts.move_boxes, 'move_boxes'),
      partners: compute(texts.count_partners, 'count_partners'),
      count: compute(paper, 'count_entries'),
      fill: compute(paper, 'fill_entries'),
      search: compute(paper, 'search_cells'),
      scan: compute(`${shaders.parameters}\n${shaders.scan_cells}`, 'scan_blocks'),
      add: compute(`${shaders.parameters}\n${shaders.scan_cells}`, 'add_block_sums'),
      counts: compute(counts, 'write_counts'),
      draw: device.createRenderPipelineAsync({
        layout: 'auto',
        vertex: { module, entryPoint: 'draw_vertex' },
        fragment: { module, entryPoint: 'draw_fragment', targets: [{ format: world.format }] },
        primitive: { topology: 'triangle-list' },
        depthStencil: { format: 'depth24plus', depthWriteEnabled: true, depthCompare: 'less' },
      }),
    };
    world.pipelines = {};
    for (const [name, pipeline] of Object.entries(pipelines)) world.pipelines[name] = await pipeline;
    world.finders = {
      throng: await GpuFinder.create({ device }),
      brute: await GpuFinder.create({ device, algorithm: 'all-pairs' }),
    };
    world.timer = new Timer(device);
    world.scratch = new Map();
    world.capacity = firstCapacity;
    world.staging = [];
    return world;
  }

  #buffer(name, size, usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC | GPUBufferUsage.COPY_DST) {
    const kept = this.scratch.get(name);
    if (kept && kept.size >= size) return kept;
    kept?.destroy();
    const limit = this.device.limits.maxStorageBufferBindingSize;
    if (size > limit) throw new Error(`${name} needs ${size} bytes, and this GPU allows ${limit}: choose fewer boxes`);
    const buffer = this.device.createBuffer({ label: name, size: Math.max(16, size), usage });
    this.scratch.set(name, buffer);
    return buffer;
  }
  #uniform(name, data) {
    const buffer = this.#buffer(name, data.byteLength, GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST);
    this.device.queue.writeBuffer(buffer, 0, data);
    return buffer;
  }
  #bind(pass, pipeline, buffers) {
    const entries = Object.entries(buffers).map(([binding, buffer]) => ({ binding: Number(binding), resource: { buffer } }));
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, this.device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
  }

  setScene(scene) {
    this.scene = scene;
    this.capacity = Math.max(firstCapacity, Math.min(8 * scene.count, this.finders.throng.maxPairs));
    this.entryCapacity = 0;
    const boxes = this.#buffer('boxes', 24 * scene.count);
    this.#buffer('partners', 4 * scene.count);
    if (scene.boxes) this.device.queue.writeBuffer(boxes, 0, scene.boxes);
    else this.device.queue.writeBuffer(this.#buffer('bodies', 32 * scene.count), 0, scene.bodies);
  }

  /** Records what comes before a search: boxes of the GPU for this time, or those that the CPU moved. */
  #move(encoder, time) {
    const { scene } = this;
    if (scene.boxes) return;
    const data = new ArrayBuffer(16);
    new Uint32Array(data)[0] = scene.count;
    new Float32Array(data).set([scene.side, time], 1);
    const pass = encoder.beginComputePass(this.timer.writes('move'));
    this.#bind(pass, this.pipelines.move, [this.#uniform('scene', data), this.#buffer('bodies', 0), this.#buffer('boxes', 0)]);
    dispatch(pass, Math.ceil(scene.count / 256));
    pass.end();
  }

  #searchByPaper(encoder, pairs, counts, perCell) {
    const { count } = this.scene;
    const { origin, scale, cells } = paperCells(this.scene, perCell);
    const cellCount = cells[0] * cells[1] * cells[2];
    const blocks = Math.ceil((cellCount + 1) / 2048);
    this.entryCapacity ||= 8 * count;
    const boxes = this.#buffer('boxes', 0);
    const parameters = this.#uniform('parameters', Uint32Array.of(count, 6, 3, this.capacity, 0, 0, 0, 0));
    const data = new ArrayBuffer(32);
    new Float32Array(data).set([...origin, scale]);
    new Uint32Array(data).set([...cells, this.entryCapacity], 4);
    const grid = this.#uniform('grid', data);
    const ranges = this.#buffer('ranges', 8 * count);
    const starts = this.#buffer('starts', 8192 * blocks);
    const places = this.#buffer('places', 4 * cellCount);
    const entries = this.#buffer('entries', 4 * this.entryCapacity);
    const sums = this.#buffer('sums', 4 * blocks);
    const report = this.#buffer('report', 64);
    const none = this.#buffer('none', 16);
    encoder.clearBuffer(starts);
    encoder.clearBuffer(places);
    encoder.clearBuffer(report);
    const { pipelines } = this;
    let pass = encoder.beginComputePass(this.timer.writes('grid'));
    this.#bind(pass, pipelines.count, { 0: parameters, 1: boxes, 2: grid, 3: ranges, 4: starts });
    dispatch(pass, Math.ceil(count / 256));
    for (const pipeline of [pipelines.scan, pipelines.add]) {
      this.#bind(pass, pipeline, { 0: starts, 1: sums });
      dispatch(pass, Math.ceil(starts.size / 8192));
    }
    this.#bind(pass, pipelines.fill, { 0: parameters, 2: grid, 3: ranges, 4: starts, 5: places, 6: entries });
    dispatch(pass, Math.ceil(count / 256));
    pass.end();
    pass = encoder.beginComputePass(this.timer.writes('search'));
    this.#bind(pass, pipelines.search, { 0: parameters, 1: boxes, 2: grid, 3: ranges, 4: starts, 6: entries, 8: pairs, 9: report, 10: none });
    dispatch(pass, cellCount);
    this.#bind(pass, pipelines.counts, [parameters, report, counts]);
    pass.dispatchWorkgroups(1);
    pass.end();
    return { cells, report, starts, cellCount };
  }

  /** Counts of partners, from pairs on the GPU. */
  #count(encoder, pairs, counts) {
    const partners = this.#buffer('partners', 0);
    encoder.clearBuffer(partners);
    const groups = this.#buffer('groups', 12, GPUBufferUsage.INDIRECT | GPUBufferUsage.COPY_DST);
    encoder.copyBufferToBuffer(counts, 16, groups, 0, 12);
    const pass = encoder.beginComputePass();
    this.#bind(pass, this.pipelines.partners, [counts, pairs, partners]);
    pass.dispatchWorkgroupsIndirect(groups, 0);
    pass.end();
  }

  #draw(encoder, camera, background) {
    const { width, height } = this.canvas;
    if (this.depth?.width !== width || this.depth?.height !== height) {
      this.depth?.destroy();
      this.depth = this.device.createTexture({ size: [width, height], format: 'depth24plus', usage: GPUTextureUsage.RENDER_ATTACHMENT });
    }
    const { matrix, eye } = camera.view(this.scene, width / height);
    const view = this.#uniform('view', Float32Array.of(...matrix, ...eye, 1));
    const pass = encoder.beginRenderPass({
      colorAttachments: [{ view: this.context.getCurrentTexture().createView(), clearValue: background, loadOp: 'clear', storeOp: 'store' }],
      depthStencilAttachment: { view: this.depth.createView(), depthClearValue: 1, depthLoadOp: 'clear', depthStoreOp: 'discard' },
      ...this.timer.writes('draw'),
    });
    this.#bind(pass, this.pipelines.draw, [view, this.#buffer('boxes', 0), this.#buffer('partners', 0)]);
    pass.draw(18, this.scene.count);
    pass.end();
  }

  /**
   * One frame: moves, searches by 'brute', 'paper' or 'throng', and draws. Returns {pairs, times, cells}. `found`, for
   * 'cpu': {boxes, pairs} that were found on the CPU.
   */
  async frame({ search, time, perCell, camera, background, found }) {
    const { device } = this;
    for (;;) {
      const encoder = device.createCommandEncoder();
      const ran = ['draw'];
      let cells;
      let paper;
      const counts = this.#buffer('counts', 32);
      if (search === 'cpu') {
        device.queue.writeBuffer(this.#buffer('boxes', 0), 0, found.boxes);
        device.queue.writeBuffer(this.#buffer('partners', 0), 0, found.partners);
      } else {
        const pairs = this.#buffer('pairs', 8 * this.capacity);
        if (!this.scene.boxes) ran.push('move');
        this.#move(encoder, time);
        ran.push('search');
        if (search === 'paper') {
          ran.push('grid');
          paper = this.#searchByPaper(encoder, pairs, counts, perCell);
          ({ cells } = paper);
        } else {
          this.finders[search].findOnGpu(this.#buffer('boxes', 0), this.scene.count, {
            capacity: this.capacity, pairs, counts, encoder, ...this.timer.writes('search'),
          });
        }
        this.#count(encoder, pairs, counts);
      }
      this.#draw(encoder, camera, background);
      const staging = this.staging.pop() ?? device.createBuffer({ size: 128, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
      this.timer.resolve(encoder, staging, 0);
      if (search !== 'cpu') encoder.copyBufferToBuffer(counts, 0, staging, 64, 32);
      if (paper) {
        encoder.copyBufferToBuffer(paper.starts, 4 * paper.cellCount, staging, 96, 4);
        encoder.copyBufferToBuffer(paper.report, 44, staging, 100, 4);
      }
      device.queue.submit([encoder.finish()]);
      await staging.mapAsync(GPUMapMode.READ);
      const data = staging.getMappedRange().slice(0);
      staging.unmap();
      this.staging.push(staging);
      const words = new Uint32Array(data);
      const times = this.timer.read(new BigUint64Array(data, 0, 8), ran);
      if (search === 'cpu') return { times };
      if (paper && words[25] !== 0) throw new Error('One cell has more than 92,682 boxes: the paper\'s grid does not fit these boxes.');
      if (paper && words[24] > this.entryCapacity) {
        this.entryCapacity = words[24];
        continue;
      }
      const pairs = words[17] + words[18] * 2 ** 32;
      if (pairs > this.capacity && this.capacity < this.finders.throng.maxPairs) {
        this.capacity = Math.min(Math.ceil(1.25 * pairs), this.finders.throng.maxPairs);
        continue;
      }
      return { pairs, times, cells, entries: paper && words[24] };
    }
  }
}
