// The WebAssembly module: loading, its memory, and calls.
import * as layout from './layout.js';
import { ThrongError, described, errorOf } from './errors.js';

class Exit extends Error {}

// What the C library of the module imports. The library reads no files, prints nothing, and has no
// environment; the clock gives the times of results.
function imports(memory) {
  const absent = 52; // WASI's ENOSYS
  const view = () => new DataView(memory().buffer);
  return {
    wasi_snapshot_preview1: {
      environ_sizes_get(count, bytes) {
        view().setUint32(count, 0, true);
        view().setUint32(bytes, 0, true);
        return 0;
      },
      environ_get: () => 0,
      clock_time_get(_clock, _precision, time) {
        view().setBigUint64(time, BigInt(Math.round(performance.now() * 1e6)), true);
        return 0;
      },
      fd_close: () => absent,
      fd_seek: () => absent,
      fd_write: () => absent,
      proc_exit(code) {
        throw new Exit(`exit ${code}`);
      },
    },
  };
}

const isModule = (value) => value instanceof WebAssembly.Module;
const isBytes = (value) => ArrayBuffer.isView(value) || Object.prototype.toString.call(value) === '[object ArrayBuffer]';
const isResponse = (value) => typeof Response === 'function' && value instanceof Response;

// In Node; on Windows its path begins with a letter and has backslashes.
function workingFolder() {
  const path = globalThis.process?.cwd?.() ?? '';
  return `file:///${path.replaceAll('\\', '/').replace(/^\//, '')}/`;
}

async function readFile(url) {
  // Bundlers for browsers must not look for this module.
  const name = 'node:fs/promises';
  const files = await import(/* @vite-ignore */ /* webpackIgnore: true */ name);
  return files.readFile(url);
}

async function instantiateResponse(response, given) {
  if (!response.ok) {
    throw new ThrongError(
      `load: ${response.url} gave HTTP status ${response.status}; serve throng.wasm there, or pass load({ module: its URL })`,
      'not_loaded',
    );
  }
  // Streaming needs the MIME type; a server without it still works.
  const type = response.headers.get('content-type') ?? '';
  if (type.startsWith('application/wasm')) return WebAssembly.instantiateStreaming(response, given);
  return WebAssembly.instantiate(await response.arrayBuffer(), given);
}

async function instantiate(source, given) {
  if (isModule(source)) return { instance: await WebAssembly.instantiate(source, given) };
  if (isBytes(source)) return WebAssembly.instantiate(source, given);
  if (isResponse(source)) return instantiateResponse(source, given);
  if (typeof source !== 'string' && !(source instanceof URL)) {
    throw new TypeError(
      `load: module: found ${described(source)}, wanted a URL, a Response, the bytes, or a WebAssembly.Module`,
    );
  }
  const url = new URL(source, globalThis.location?.href ?? workingFolder());
  if (url.protocol === 'file:') return WebAssembly.instantiate(await readFile(url), given);
  return instantiateResponse(await fetch(url), given);
}

/** One instance of the module. */
export class Instance {
  #exports;
  #bytes = new Uint8Array(0);
  #scratch = new Map();
  #ended = null;

  /** Loads the module; `source`: see load(). */
  static async load(source) {
    let memory;
    let loaded;
    try {
      loaded = await instantiate(source, imports(() => memory));
    } catch (error) {
      if (!(error instanceof WebAssembly.CompileError)) throw error;
      throw new ThrongError(
        'load: the module does not compile here: it is not throng.wasm, or the browser lacks WebAssembly with 128-bit SIMD ' +
          '(Chrome 91, Firefox 89, Safari 16.4), or its content security policy lacks wasm-unsafe-eval',
        'not_loaded',
        { cause: error },
      );
    }
    const { exports } = loaded.instance;
    if (!exports.throng_version) {
      throw new TypeError('load: module: found another WebAssembly module, wanted throng.wasm of this package');
    }
    memory = exports.memory;
    exports._initialize();
    return new Instance(exports);
  }

  constructor(exports) {
    this.#exports = exports;
  }

  get hasEnded() {
    return this.#ended !== null;
  }
  get memory() {
    return this.#exports.memory;
  }

  /** All bytes; memory that grows gives its views another buffer, so keep none. */
  get bytes() {
    if (this.#bytes.buffer !== this.memory.buffer) this.#bytes = new Uint8Array(this.memory.buffer);
    return this.#bytes;
  }
  get data() {
    return new DataView(this.memory.buffer);
  }
  u32(at, count) {
    return new Uint32Array(this.memory.buffer, at, count);
  }
  f32(at, count) {
    return new Float32Array(this.memory.buffer, at, count);
  }

  /** The text of a C string. */
  text(at) {
    const { bytes } = this;
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at)));
  }

  /** Calls an exported function. A lack of memory in it ends the instance. */
  call(name, ...given) {
    if (this.#ended) throw this.#gone();
    try {
      const value = this.#exports[name](...given);
      return typeof value === 'number' ? value >>> 0 : value;
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError || error instanceof Exit || error instanceof RangeError)) {
        throw error;
      }
      const [lack, bytes] = this.u32(this.#exports.throng_web_lack.value, 2);
      this.#ended = { lack, bytes, cause: error };
      throw this.#gone();
    }
  }

  #gone() {
    const { lack, bytes, cause } = this.#ended;
    if (!lack) {
      return new ThrongError(
        `an internal error ended this instance (${cause.message}); load() makes another; please report it`,
        'ended',
        { cause },
      );
    }
    const what = bytes ? `allocating ${bytes} bytes failed` : 'more than the address space is needed';
    return new ThrongError(
      `out of memory: ${what}, of at most 4 GiB; this ended the instance with all its objects: load() makes ` +
        'another; search fewer boxes at once',
      'out_of_memory',
      { bytesNeeded: bytes || undefined, cause },
    );
  }

  /** Memory of at least `size` bytes; an error that leaves the instance as it is, if there is none. */
  allocate(size) {
    const at = size < 2 ** 32 ? this.call('malloc', Math.max(size, 16)) : 0;
    if (at !== 0) return at;
    throw new ThrongError(
      `out of memory: allocating ${size} bytes failed, of at most 4 GiB for all; search fewer boxes at once`,
      'out_of_memory',
      { bytesNeeded: size },
    );
  }
  release(at) {
    if (at !== 0 && !this.#ended) this.call('free', at);
  }

  /** Memory for one argument of a call, kept for later calls. */
  scratch(name, size) {
    const kept = this.#scratch.get(name);
    if (kept && kept.size >= size) return kept.at;
    if (kept) {
      this.#scratch.delete(name);
      this.release(kept.at);
    }
    const wanted = size + Math.floor(size / 8);
    const at = this.allocate(wanted);
    this.#scratch.set(name, { at, size: wanted });
    return at;
  }

  /** A typed array as an address: its own if it lies in this memory, else that of a copy. */
  address(name, array) {
    if (array.inside !== undefined) return array.inside;
    const at = this.scratch(name, array.byteLength);
    this.bytes.set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength), at);
    return at;
  }

  /** The number of pairs in a throng_result. */
  found(at) {
    return Number(this.data.getBigUint64(at + layout.result.found, true));
  }
  /** The fields of a throng_result. */
  result(at) {
    const { data } = this;
    const count = (field) => Number(data.getBigUint64(at + layout.result[field], true));
    return {
      found: count('found'),
      written: count('written'),
      inactive: count('inactive'),
      comparisons: count('comparisons'),
      firstInvalid: count('firstInvalid'),
      invalidCount: count('invalidCount'),
      bytesNeeded: count('bytesNeeded'),
      totalMs: data.getFloat64(at + layout.result.totalMs, true),
      plan: this.text(data.getUint32(at + layout.result.plan, true)),
      message: this.text(data.getUint32(at + layout.result.message, true)),
      algorithm: data.getInt32(at + layout.result.algorithm, true),
      isa: data.getInt32(at + layout.result.isa, true),
    };
  }

  /** Throws what a call that returned `status` left in its result. */
  check(status, resultOf, handle) {
    if (status === 0) return;
    const result = this.result(this.call(resultOf, handle));
    throw errorOf(status, result.message, result);
  }
}
