// Writes the shaders of web/wgsl and their steps as one ES module, so that a page loads one file:
// node pack_shaders.mjs WGSL_FOLDER OUTPUT
import { readFile, readdir, writeFile } from 'node:fs/promises';
import { join } from 'node:path';

const [folder, output] = process.argv.slice(2);
const { steps, frames } = JSON.parse(await readFile(join(folder, 'steps.json'), 'utf8'));
const shaders = {};
for (const file of (await readdir(folder)).sort()) {
  if (file.endsWith('.wgsl')) shaders[file.slice(0, -5)] = await readFile(join(folder, file), 'utf8');
}
for (const [name, { files }] of Object.entries(steps)) {
  const missing = files.filter((file) => !(file in shaders));
  if (missing.length > 0) throw new Error(`steps.json: ${name} needs ${missing.join(', ')}, which ${folder} lacks`);
}
const parts = Object.entries({ shaders, steps, frames }).map(([name, value]) => `export const ${name} = ${JSON.stringify(value)};\n`);
await writeFile(output, `// Written by pack_shaders.mjs.\n${parts.join('')}`);
