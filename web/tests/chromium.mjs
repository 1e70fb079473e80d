// Opens a page in headless Chromium: from a folder that is served on the loopback interface, until the page sends a report.
import { spawn } from 'node:child_process';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { serve } from '../serve.mjs';

const limit = 600_000; // ms

/** The executable: the variable CHROMIUM, or chromium. */
export const program = process.env.CHROMIUM ?? 'chromium';

// SwiftShader for WebGPU. The sandbox cannot be set up in most containers; the pages are ours.
const flags = ['--headless', '--no-sandbox', '--disable-gpu-sandbox', '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader',
  '--enable-features=Vulkan', '--use-angle=swiftshader', '--use-vulkan=swiftshader', '--no-first-run', '--disable-extensions', '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--disable-default-apps', '--disable-dev-shm-usage', '--enable-logging=stderr'];

/**
 * `pages` maps addresses to the text of pages that are not in the folder. The page at `path` sends JSON by POST to any address.
 * Resolves to what it sent, or to { failed }, with Chromium's `log` added.
 */
export async function openInChromium(folder, path, pages = {}) {
  let reported;
  const report = new Promise((resolve) => (reported = resolve));
  const server = await serve(folder, 0, async (request, response) => {
    if (request.method === 'POST') {
      let body = '';
      for await (const chunk of request) body += chunk;
      response.end();
      reported(JSON.parse(body));
      return true;
    }
    if (!Object.hasOwn(pages, request.url)) return false;
    response.setHeader('Content-Type', 'text/html; charset=utf-8');
    response.end(pages[request.url]);
    return true;
  });
  const profile = await mkdtemp(join(tmpdir(), 'throng-chromium-'));
  const address = `http://127.0.0.1:${server.address().port}${path}`;
  const browser = spawn(program, [...flags, `--user-data-dir=${profile}`, address], { stdio: ['ignore', 'ignore', 'pipe'] });
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
  return { ...found, log };
}
