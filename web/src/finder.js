// Searches: Finder.
import * as layout from './layout.js';
import * as argument from './arguments.js';
import { Handle, optionNames, publicResult, writeBoxes } from './handle.js';

export const finderOptions = [...optionNames, 'order', 'algorithm'];
const otherFilters = argument.filterNames.map((name) => `other${name[0].toUpperCase()}${name.slice(1)}`);
export const searchOptions = ['other', ...argument.filterNames, ...otherFilters];
const bufferTooSmall = 1;

/** Finds pairs repeatedly and keeps its memory. */
export class Finder {
  #handle;
  #capacity = 0;

  constructor(instance, options, defaultInverted = 'inactive') {
    this.#handle = new Handle('Finder', 'throng_finder', instance, options, defaultInverted);
  }

  find(boxes, options) {
    const { instance, dimensions } = this.#handle;
    const given = argument.object(options, searchOptions);
    const set = argument.boxes(instance, boxes, 'boxes', dimensions);
    const filters = argument.filters(instance, given, set.count);
    const hasOther = given.other !== undefined;
    const other = hasOther && argument.boxes(instance, given.other, 'other', dimensions);
    const ofOther = hasOther ? argument.filters(instance, given, other.count, 'other') : {};
    const stray = hasOther ? undefined : otherFilters.find((name) => given[name] !== undefined);
    if (stray) throw new TypeError(`${stray}: found no other boxes; give them as other`);

    const { at } = this.#handle; // now, as options may have getters
    for (const array of [...Object.values(set), ...Object.values(other || {}), ...Object.values(filters), ...Object.values(ofOther)]) {
      // An earlier result of this finder: its memory is written, or replaced.
      if (array.inside >= this.#pairs && array.inside < this.#pairs + this.#capacity * layout.pair.bytes) array.inside = undefined;
    }
    const first = writeBoxes(instance, 'boxes', set, filters, dimensions);
    const second = hasOther ? writeBoxes(instance, 'other', other, ofOther, dimensions) : 0;
    this.#reserve(Math.max(1024, 4 * (set.count + (hasOther ? other.count : 0))));
    for (;;) {
      const status = instance.call('throng_find_into', at, first, second, this.#pairs, this.#capacity);
      if (status !== 0 && status !== bufferTooSmall) instance.check(status, 'throng_finder_result', at);
      const found = instance.found(instance.call('throng_finder_result', at));
      if (status === 0) return this.#handle.view(this.#pairs, 2 * found);
      this.#reserve(found);
    }
  }

  get #pairs() {
    return this.#handle.more.get('pairs') ?? 0;
  }
  #reserve(count) {
    if (count <= this.#capacity) return;
    const { instance, more } = this.#handle;
    instance.release(this.#pairs);
    more.delete('pairs');
    this.#capacity = 0;
    more.set('pairs', instance.allocate(count * layout.pair.bytes));
    this.#capacity = count;
  }

  get result() {
    const { instance, at } = this.#handle;
    return publicResult(instance, instance.call('throng_finder_result', at));
  }
  get memoryBytes() {
    const { instance, at } = this.#handle;
    return instance.call('throng_finder_memory_bytes', at) + this.#capacity * layout.pair.bytes;
  }
  free() {
    this.#handle.free();
  }
}
if (Symbol.dispose) Finder.prototype[Symbol.dispose] = Finder.prototype.free;
