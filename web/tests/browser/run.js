// Runs the test files that the address names, ?files=a,b, and sends the results to the server.
import { runAll } from './test.js';

const results = [];
const problems = [];
for (const kind of ['error', 'warn']) {
  console[kind] = (...texts) => problems.push(`console.${kind}: ${texts.join(' ')}`);
}
console.log = () => {}; // the examples; what else reaches the console is a problem
addEventListener('error', (event) => problems.push(`uncaught: ${event.message}`));
addEventListener('unhandledrejection', (event) => problems.push(`unhandled: ${event.reason}`));

for (const file of new URLSearchParams(location.search).get('files').split(',')) {
  try {
    await import(`../${file}`);
    const found = await runAll();
    if (found.length === 0) problems.push(`${file}: no tests`);
    results.push(...found.map(([name, error]) => [`${file}: ${name}`, error]));
  } catch (error) {
    problems.push(`${file}: ${error.stack}`);
  }
}
await fetch('/report', { method: 'POST', body: JSON.stringify({ results, problems, isolated: crossOriginIsolated }) });
