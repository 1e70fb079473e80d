// What the tests use of node:assert/strict, in a browser.
function fail(text, message) {
  throw new Error(message ? `${text} (${message})` : text);
}
function shown(value) {
  const text = typeof value === 'object' ? JSON.stringify(value) : String(value);
  return text.length <= 200 ? text : `${text.slice(0, 200)}...`;
}
function same(a, b) {
  if (Object.is(a, b)) return true;
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return false;
  if (Object.getPrototypeOf(a) !== Object.getPrototypeOf(b)) return false;
  const keys = Object.keys(a);
  return keys.length === Object.keys(b).length && keys.every((key) => Object.hasOwn(b, key) && same(a[key], b[key]));
}
function fits(error, wanted) {
  if (typeof wanted === 'function') return error instanceof wanted;
  return Object.entries(wanted).every(([key, value]) =>
    value instanceof RegExp ? value.test(error[key]) : same(error[key], value),
  );
}

export default {
  ok(value, message) {
    if (!value) fail(`found ${shown(value)}, wanted something true`, message);
  },
  equal(found, wanted, message) {
    if (!Object.is(found, wanted)) fail(`found ${shown(found)}, wanted ${shown(wanted)}`, message);
  },
  notEqual(found, other, message) {
    if (Object.is(found, other)) fail(`found ${shown(found)} twice`, message);
  },
  deepEqual(found, wanted, message) {
    if (!same(found, wanted)) fail(`found ${shown(found)}, wanted ${shown(wanted)}`, message);
  },
  match(text, wanted, message) {
    if (!wanted.test(text)) fail(`found ${shown(text)}, wanted ${wanted}`, message);
  },
  throws(run, wanted, message) {
    try {
      run();
    } catch (error) {
      if (!fits(error, wanted)) fail(`found ${error.name} ${error.code}: ${error.message}`, message);
      return;
    }
    fail('found no error', message);
  },
  async rejects(promise, wanted, message) {
    try {
      await promise;
    } catch (error) {
      if (!fits(error, wanted)) fail(`found ${error.name} ${error.code}: ${error.message}`, message);
      return;
    }
    fail('found no error', message);
  },
};
