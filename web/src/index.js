// Every pair of overlapping boxes among very many moving objects, in JavaScript: see index.d.ts.
import * as argument from './arguments.js';
import { BroadPhase } from './broad_phase.js';
import { ThrongError } from './errors.js';
import { Finder, finderOptions, searchOptions } from './finder.js';
import { Instance } from './wasm.js';

export { ThrongError };

const picked = (options, names) => Object.fromEntries(names.filter((name) => name in options).map((name) => [name, options[name]]));

/** Loads the WebAssembly module; each call makes an instance with memory of its own. */
export async function load(options) {
  const given = argument.object(options, ['module']);
  const instance = await Instance.load(given.module ?? new URL('./throng.wasm', import.meta.url));

  class BoundFinder extends Finder {
    constructor(options) {
      super(instance, argument.object(options, finderOptions));
    }
  }
  class BoundBroadPhase extends BroadPhase {
    constructor(options) {
      super(instance, argument.object(options, BroadPhase.options));
    }
  }
  Object.defineProperty(BoundFinder, 'name', { value: 'Finder' });
  Object.defineProperty(BoundBroadPhase, 'name', { value: 'BroadPhase' });

  return Object.freeze({
    version: instance.text(instance.call('throng_version')),
    Finder: BoundFinder,
    BroadPhase: BoundBroadPhase,

    findPairs(boxes, options) {
      const given = argument.object(options, [...finderOptions, ...searchOptions]);
      const finder = new Finder(instance, picked(given, finderOptions), 'refuse');
      try {
        return finder.find(boxes, picked(given, searchOptions)).slice();
      } finally {
        finder.free();
      }
    },

    allocateBoxes(count, options) {
      const { dimensions = 3 } = argument.object(options, ['dimensions']);
      argument.integer(count, 'count', 0, 0xffffffff);
      argument.integer(dimensions, 'dimensions', 2, 3);
      const size = 8 * dimensions * count;
      const at = instance.allocate(size);
      instance.bytes.fill(0, at, at + size);
      return new argument.BoxMemory(instance, at, count, dimensions);
    },

    get memoryBytes() {
      return instance.memory.buffer.byteLength;
    },
  });
}
