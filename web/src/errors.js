// Errors of the library. Wrong arguments that JavaScript finds are a TypeError or a RangeError.

// The names of throng_status, by value.
const codes = [
  'ok',
  'buffer_too_small',
  'stopped',
  'nan_box',
  'bad_boxes',
  'bad_filter',
  'bad_option',
  'too_many_boxes',
  'out_of_memory',
  'memory_cap_too_small',
  'unsupported_isa',
  'no_device',
  'device_error',
  'not_reserved',
  'bad_bodies',
  'bad_shape',
  'bad_id',
  'busy',
  'unknown',
  'unknown',
  'inverted_box',
  'bad_mesh',
];

/** An error with the message of the library: the value found, and the remedy. */
export class ThrongError extends Error {
  constructor(message, code, details = {}) {
    super(message, details.cause === undefined ? undefined : { cause: details.cause });
    this.name = 'ThrongError';
    /** What went wrong, such as 'nan_box', 'out_of_memory' or 'released'. */
    this.code = code;
    /** The index of the first invalid box, sweep or id. */
    this.firstInvalid = details.firstInvalid;
    /** The number of invalid ones. */
    this.invalidCount = details.invalidCount;
    /** Bytes that could not be allocated. */
    this.bytesNeeded = details.bytesNeeded;
  }
}

// The library names what C++ programs write.
const words = [
  ['treat them as inactive by Options::nan', "pass nan: 'inactive'"],
  ['set Options::inverted to inactive', "pass inverted: 'inactive'"],
  ['box_from_center(center, size / 2)', 'center - size / 2 and center + size / 2'],
  ['take pairs in blocks by Finder::consume, or split the boxes', 'split the boxes'],
  ['id_limit()', 'idLimit'],
  ['Options::isa', 'isa'],
  ['max_distance', 'maxDistance'],
  ['find_overlaps', 'findOverlaps'],
];

export function errorOf(status, message, details) {
  let text = message;
  for (const [from, to] of words) text = text.replaceAll(from, to);
  const code = codes[status] ?? 'unknown';
  const invalid = details.invalidCount > 0;
  return new ThrongError(text, code, {
    firstInvalid: invalid ? details.firstInvalid : undefined,
    invalidCount: invalid ? details.invalidCount : undefined,
    bytesNeeded: details.bytesNeeded || undefined,
  });
}

/** A value, for a message. */
export function described(value) {
  if (value === null || value === undefined) return String(value);
  if (typeof value === 'string') return `'${value.length <= 60 ? value : `${value.slice(0, 57)}...`}'`;
  if (typeof value === 'function') return 'a function';
  if (typeof value === 'object') {
    const name = value.constructor?.name ?? 'object';
    return `${/^[AEIO]/.test(name) ? 'an' : 'a'} ${name}`;
  }
  return String(value);
}
