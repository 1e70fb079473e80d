// Serves a folder on the loopback interface: node serve.mjs FOLDER [PORT]. With the headers that give a page
// SharedArrayBuffer and exact times.
import { createServer } from 'node:http';
import { readFile, stat } from 'node:fs/promises';
import { extname, join, normalize, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const types = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.mjs': 'text/javascript; charset=utf-8',
  '.json': 'application/json',
  '.css': 'text/css; charset=utf-8',
  '.wasm': 'application/wasm',
  '.wgsl': 'text/plain; charset=utf-8',
  '.svg': 'image/svg+xml',
  '.png': 'image/png',
};

async function fileOf(folder, address) {
  const path = join(folder, normalize(decodeURIComponent(address)));
  return (await stat(path)).isDirectory() ? join(path, 'index.html') : path;
}

/** `answer(request, response)` may answer a request itself, and then returns true. Resolves to the server. */
export async function serve(folder, port = 0, answer = async () => false) {
  const server = createServer(async (request, response) => {
    response.setHeader('Cross-Origin-Opener-Policy', 'same-origin');
    response.setHeader('Cross-Origin-Embedder-Policy', 'require-corp');
    response.setHeader('Cache-Control', 'no-store');
    try {
      if (await answer(request, response)) return;
      const { pathname } = new URL(request.url, 'http://127.0.0.1');
      const path = await fileOf(resolve(folder), pathname);
      const bytes = await readFile(path);
      response.setHeader('Content-Type', types[extname(path)] ?? 'application/octet-stream');
      response.end(bytes);
    } catch (error) {
      response.statusCode = error.code === 'ENOENT' ? 404 : 500;
      response.end(`${request.url}: ${error.message}\n`);
    }
  });
  await new Promise((ready, failed) => server.once('error', failed).listen(port, '127.0.0.1', ready));
  return server;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [folder = '.', port = '8080'] = process.argv.slice(2);
  const server = await serve(folder, Number(port)).catch((error) => {
    console.error(`port ${port}: ${error.message}; choose another one`);
    process.exit(1);
  });
  console.log(`http://127.0.0.1:${server.address().port}/`);
}
