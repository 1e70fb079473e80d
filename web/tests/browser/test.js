// What the tests use of node:test, in a browser.
const tests = [];

export default function test(name, run) {
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
