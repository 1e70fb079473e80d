// What the tests use of node:test, in a browser.
const tests = [];

/** test(name, run), or test(name, { skip }, run). */
export default function test(name, options, run = options) {
  if (options.skip) return;
  tests.push({ name, run });
}
/** Runs what was registered since the last call; returns [name, error or null] of each. */
export async function runAll() {
  const results = [];
  for (const { name, run } of tests.splice(0)) {
    try {
      await run();
      results.push([name, null]);
    } catch (error) {
      results.push([name, `${error.name}: ${error.message}\n${error.stack}`]);
    }
  }
  return results;
}
