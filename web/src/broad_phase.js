// Persistent objects: BroadPhase.
import * as layout from './layout.js';
import * as argument from './arguments.js';
import { errorOf } from './errors.js';
import { Handle, optionNames, publicResult, writeBoxes } from './handle.js';

const noBoxes = { count: 0 };
const noObject = 0xffffffff;
const allLayers = 0xffffffff;
const which = ['all', 'first'];
const hitOptions = [...argument.filterNames, 'which'];
const raycastOptions = ['maxDistance', 'layerMask', 'world'];

/** Keeps objects from frame to frame, and reports which pairs began and which ended. */
export class BroadPhase {
  static options = optionNames;
  #handle;
  #given;

  constructor(instance, options) {
    this.#given = options;
    this.#handle = new Handle('BroadPhase', 'throng_broad_phase', instance, options, 'inactive');
  }

  // Calls throng_broad_phase_`name`, which returns a status.
  #call(name, ...given) {
    const { instance, at } = this.#handle;
    const status = instance.call(`throng_broad_phase_${name}`, at, ...given);
    instance.check(status, 'throng_broad_phase_result', at);
  }
  // A list of structs of `words` uint32 each, in place.
  #list(name, words) {
    const { instance, at } = this.#handle;
    const count = instance.scratch('count', 4);
    const first = instance.call(`throng_broad_phase_${name}`, at, count);
    const [found] = instance.u32(count, 1);
    return this.#handle.view(first, found * words);
  }
  #number(name) {
    const { instance, at } = this.#handle;
    return Number(instance.call(`throng_broad_phase_${name}`, at));
  }
  #boxes(boxes, filters = {}) {
    return writeBoxes(this.#handle.instance, 'boxes', boxes, filters, this.#handle.dimensions);
  }
  #checked(boxes) {
    return argument.boxes(this.#handle.instance, boxes, 'boxes', this.#handle.dimensions);
  }

  copy() {
    const made = new this.constructor(this.#given);
    const { instance, at } = this.#handle;
    try {
      const status = instance.call('throng_broad_phase_copy', made.#handle.at, at);
      instance.check(status, 'throng_broad_phase_result', made.#handle.at);
    } catch (error) {
      made.free();
      throw error;
    }
    return made;
  }

  add(boxes, options) {
    const { instance } = this.#handle;
    const given = argument.object(options, argument.filterNames);
    const set = this.#checked(boxes);
    const filters = argument.filters(instance, given, set.count);
    const ids = instance.scratch('ids', 4 * set.count);
    this.#call('add', this.#boxes(set, filters), ids);
    return instance.u32(ids, set.count).slice();
  }
  remove(ids) {
    const { instance } = this.#handle;
    const given = argument.ids(instance, ids);
    this.#call('remove', instance.address('ids', given), given.length);
  }
  move(ids, boxes) {
    const { instance } = this.#handle;
    const given = argument.ids(instance, ids);
    const set = this.#checked(boxes);
    argument.oneEach(set.count, given.length, 'boxes');
    const list = instance.address('ids', given);
    this.#call('move', list, this.#boxes(set));
  }
  moveAll(boxes) {
    this.#call('move_all', this.#boxes(this.#checked(boxes)));
  }
  setFilters(ids, options) {
    const { instance } = this.#handle;
    const given = argument.ids(instance, ids);
    const filters = argument.filters(instance, argument.object(options, argument.filterNames), given.length);
    const list = instance.address('ids', given);
    this.#call('set_filters', list, this.#boxes({ ...noBoxes, count: given.length }, filters));
  }
  shiftOrigin(by) {
    const { instance, dimensions } = this.#handle;
    const vector = argument.vector(by, 'by', dimensions);
    const at = instance.scratch('vector', 12);
    instance.f32(at, 3).set(vector);
    this.#call('shift_origin', at);
  }

  update() {
    this.#call('update');
  }
  get begun() {
    return this.#list('begun', 3);
  }
  get ended() {
    return this.#list('ended', 3);
  }
  get pairs() {
    return this.#list('pairs', 3);
  }
  pairsOf(id) {
    const { instance, at } = this.#handle;
    argument.id(id);
    let capacity = 64;
    for (;;) {
      const out = instance.scratch('pairs of', capacity * layout.livePair.bytes);
      const count = instance.call('throng_broad_phase_pairs_of', at, id, out, capacity);
      if (count <= capacity) return instance.u32(out, 3 * count).slice();
      capacity = count;
    }
  }

  findOverlaps(boxes, options) {
    const { instance } = this.#handle;
    const given = argument.object(options, argument.filterNames);
    const set = this.#checked(boxes);
    const filters = argument.filters(instance, given, set.count);
    this.#call('find_overlaps', this.#boxes(set, filters));
    return this.#list('overlaps', 2);
  }

  findHits(boxes, by, options) {
    const { instance, dimensions } = this.#handle;
    const given = argument.object(options, hitOptions);
    const first = argument.choice(given.which ?? 'all', 'which', which);
    const set = this.#checked(boxes);
    const wanted = `a Float32Array with ${dimensions} numbers per box`;
    const moves = argument.floats(instance, by, 'by', wanted);
    if (moves.length !== dimensions * set.count) {
      throw new RangeError(`by: found ${moves.length} numbers, wanted ${dimensions * set.count}, ${dimensions} per box`);
    }
    const filters = argument.filters(instance, given, set.count);
    const sweeps = this.#writeSweeps(set, moves);
    const ofSweeps = this.#boxes({ ...noBoxes, count: set.count }, filters);
    this.#call('find_hits', sweeps, set.count, first, ofSweeps);
    const hits = this.#list('hits', layout.sweepHit.words);
    const pairs = new Uint32Array(hits.length / 2);
    const times = new Float64Array(hits.length / 4);
    const kept = new Float64Array(hits.buffer, hits.byteOffset, hits.length / 2);
    for (let i = 0; i < times.length; ++i) {
      pairs[2 * i] = hits[4 * i];
      pairs[2 * i + 1] = hits[4 * i + 1];
      times[i] = kept[2 * i + 1];
    }
    return { pairs, times };
  }
  // An array of throng_sweep.
  #writeSweeps(set, moves) {
    const { instance, dimensions: d } = this.#handle;
    const at = instance.scratch('sweeps', set.count * layout.sweep.bytes);
    const { words } = layout.sweep;
    const read = (array) =>
      array.inside === undefined
        ? new Float32Array(array.buffer, array.byteOffset, array.length)
        : instance.f32(array.inside, array.length);
    const lower = read(set.packed ?? set.lower);
    const upper = set.packed ? lower : read(set.upper);
    const each = set.packed ? 2 * d : d;
    const toUpper = set.packed ? d : 0;
    const by = read(moves);
    const out = instance.f32(at, set.count * words);
    out.fill(0);
    for (let i = 0; i < set.count; ++i) {
      for (let axis = 0; axis < d; ++axis) {
        out[words * i + axis] = lower[each * i + axis];
        out[words * i + 3 + axis] = upper[each * i + toUpper + axis];
        out[words * i + 6 + axis] = by[d * i + axis];
      }
    }
    return at;
  }

  raycast(origin, direction, options) {
    const { instance, dimensions, more } = this.#handle;
    const given = argument.object(options, raycastOptions);
    const from = argument.vector(origin, 'origin', dimensions);
    const along = argument.vector(direction, 'direction', dimensions);
    const maxDistance = argument.number(given.maxDistance ?? Infinity, 'maxDistance');
    const mask = argument.integer(given.layerMask ?? allLayers, 'layerMask', 0, allLayers);
    const world = argument.integer(given.world ?? -1, 'world', -1, 0x7fffffff);
    const { at } = this.#handle; // now, as options may have getters
    if (!more.has('query')) {
      const options = instance.scratch('options', layout.options.bytes);
      instance.call('throng_options_init_sized', options, layout.options.bytes);
      more.set('query', instance.call('throng_query_create', options));
    }
    const query = more.get('query');
    const { filter, rayHit } = layout;
    const vectors = instance.scratch('vectors', 24);
    const hit = instance.scratch('ray hit', rayHit.bytes);
    const ofRay = instance.scratch('ray filter', filter.bytes);
    instance.f32(vectors, 6).set([...from, ...along]);
    const { data } = instance;
    data.setUint32(ofRay, allLayers, true);
    data.setUint32(ofRay + filter.mask, mask, true);
    data.setInt32(ofRay + filter.owner, -1, true);
    data.setInt32(ofRay + filter.world, world, true);
    data.setUint32(ofRay + filter.static, 0, true);
    const status = instance.call('throng_query_raycast', query, at, vectors, vectors + 12, maxDistance, ofRay, 0, 0, hit);
    instance.check(status, 'throng_query_result', query);
    const [object] = instance.u32(hit, 1);
    if (object === noObject) return null;
    return {
      object,
      distance: instance.data.getFloat64(hit + rayHit.distance, true),
      point: [...instance.f32(hit + rayHit.point, dimensions)],
      normal: [...instance.f32(hit + rayHit.normal, dimensions)],
    };
  }

  isAlive(id) {
    const { instance, at } = this.#handle;
    return instance.call('throng_broad_phase_is_alive', at, argument.id(id)) === 1;
  }
  #ofObject(name, id, bytes) {
    const { instance, at } = this.#handle;
    const out = instance.scratch(name, bytes);
    const status = instance.call(`throng_broad_phase_${name}`, at, argument.id(id), out);
    if (status !== 0) throw errorOf(status, `id ${id} is not alive; use ids that add() returned`, {});
    return out;
  }
  box(id) {
    const { instance, dimensions } = this.#handle;
    const all = instance.f32(this.#ofObject('box', id, layout.box.bytes), 6);
    return dimensions === 3 ? all.slice() : Float32Array.of(all[0], all[1], all[3], all[4]);
  }
  filter(id) {
    const { filter } = layout;
    const out = this.#ofObject('filter', id, filter.bytes);
    const { data } = this.#handle.instance;
    return {
      group: data.getUint32(out, true),
      mask: data.getUint32(out + filter.mask, true),
      owner: data.getInt32(out + filter.owner, true),
      world: data.getInt32(out + filter.world, true),
      static: data.getUint8(out + filter.static) !== 0,
    };
  }
  get objectCount() {
    return this.#number('object_count');
  }
  get pairCount() {
    return this.#number('pair_count');
  }
  get idLimit() {
    return this.#number('id_limit');
  }
  get slotLimit() {
    return this.#number('slot_limit');
  }
  get memoryBytes() {
    return this.#number('memory_bytes');
  }
  get result() {
    const { instance, at } = this.#handle;
    return publicResult(instance, instance.call('throng_broad_phase_result', at));
  }
  free() {
    this.#handle.free();
  }
}
if (Symbol.dispose) BroadPhase.prototype[Symbol.dispose] = BroadPhase.prototype.free;
