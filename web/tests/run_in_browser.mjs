// Runs test files in headless Chromium: node run_in_browser.mjs FOLDER FILE... FOLDER is served; the files are in its
// web-tests. Fails if a test fails, or if the page writes errors or warnings to the console.
import { spawn } from 'node:child_process';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { serve } from '../serve.mjs';

const limit = 600_000; // ms
const [folder, ...files] = process.argv.slice(2);
const program = process.env.CHROMIUM ?? 'chromium';

let reported;
const report = new Promise((resolve) => (reported = resolve));
const server = await serve(folder, 0, async (request, response) => {
  if (request.method !== 'POST') return false;
  let body = '';
  for await (const chunk of request) body += chunk;
  response.end();
  reported(JSON.parse(body));
  return true;
});

const profile = await mkdtemp(join(tmpdir(), 'throng-chromium-'));
const address = `http://127.0.0.1:${server.address().port}/web-tests/browser/?files=${files.join(',')}`;
// SwiftShader for WebGPU. The sandbox cannot be set up in most containers; the pages are ours.
const flags = ['--headless', '--no-sandbox', '--disable-gpu-sandbox', '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader',
  '--enable-features=Vulkan', '--use-angle=swiftshader', '--use-vulkan=swiftshader', '--no-first-run', '--disable-extensions', '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--disable-default-apps', '--disable-dev-shm-usage', '--enable-logging=stderr', `--user-data-dir=${profile}`];
const browser = spawn(program, [...flags, address], { stdio: ['ignore', 'ignore', 'pipe'] });
let log = '';
browser.stderr.on('data', (text) => (log += text));
const ended = new Promise((resolve) => {
  browser.once('error', (error) => resolve({ failed: `${program}: ${error.message}` }));
  browser.once('exit', (code) => resolve({ failed: `${program} ended with ${code}` }));
});
let timer;
const late = new Promise((resolve) => {
  timer = setTimeout(() => resolve({ failed: `no results within ${limit / 1000} s` }), limit);
});

const found = await Promise.race([report, ended, late]);
clearTimeout(timer);
browser.kill();
await ended;
server.close();
server.closeAllConnections();
await rm(profile, { recursive: true, force: true, maxRetries: 5 });

const problems = [...(found.problems ?? [])];
if (found.failed) problems.push(found.failed, log);
// What the browser itself writes to the console, such as a file that was not found.
problems.push(...log.split('\n').filter((line) => line.includes(':CONSOLE')));
if (found.isolated === false) problems.push('the page is not cross-origin isolated');
const results = found.results ?? [];
const failures = results.filter(([, error]) => error !== null);
for (const [name, error] of failures) console.log(`not ok ${name}\n${error}`);
for (const problem of problems) console.log(problem);
console.log(`${results.length - failures.length} of ${results.length} tests passed in Chromium`);
process.exitCode = failures.length > 0 || problems.length > 0 || results.length === 0 ? 1 : 0;
