// Runs test files in headless Chromium: node run_in_browser.mjs FOLDER FILE... FOLDER is served; the files are in its
// web-tests. Fails if a test fails, or if the page writes errors or warnings to the console.
import { openInChromium } from './chromium.mjs';

const [folder, ...files] = process.argv.slice(2);
const found = await openInChromium(folder, `/web-tests/browser/?files=${files.join(',')}`);

const problems = [...(found.problems ?? [])];
if (found.failed) problems.push(found.failed, found.log);
// What the browser itself writes to the console, such as a file that was not found.
problems.push(...found.log.split('\n').filter((line) => line.includes(':CONSOLE')));
if (found.isolated === false) problems.push('the page is not cross-origin isolated');
const results = found.results ?? [];
const failures = results.filter(([, error]) => error !== null);
for (const [name, error] of failures) console.log(`not ok ${name}\n${error}`);
for (const problem of problems) console.log(problem);
console.log(`${results.length - failures.length} of ${results.length} tests passed in Chromium`);
process.exitCode = failures.length > 0 || problems.length > 0 || results.length === 0 ? 1 : 0;
