// Draws without a GPU: each box as a rectangle, the farthest first.

const colours = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
function colourOf(count) {
  const value = Math.min(count, 8) / 2;
  const k = Math.min(Math.floor(value), 3);
  const mixed = colours[k].map((from, c) => Math.round(from + (colours[k + 1][c] - from) * (value - k)));
  return `rgb(${mixed.join()})`;
}
const palette = Array.from({ length: 9 }, (_, count) => colourOf(count));

export function drawFlat(canvas, scene, camera, { boxes, partners }) {
  const context = canvas.getContext('2d');
  const { width, height } = canvas;
  context.clearRect(0, 0, width, height);
  const { matrix: m } = camera.view(scene, width / height);
  // More would take seconds to draw.
  const step = Math.ceil(scene.count / 20000);
  const drawn = [];
  for (let i = 0; i < scene.count; i += step) {
    const centre = [0, 1, 2].map((k) => (boxes[6 * i + k] + boxes[6 * i + 3 + k]) / 2);
    const [x, y, , w] = [0, 1, 2, 3].map((r) => m[r] * centre[0] + m[4 + r] * centre[1] + m[8 + r] * centre[2] + m[12 + r]);
    if (!(w > 0)) continue;
    const size = ((boxes[6 * i + 3] - boxes[6 * i]) * height * 1.37) / w;
    drawn.push([w, (x / w + 1) * 0.5 * width, (1 - y / w) * 0.5 * height, Math.max(1, size), palette[Math.min(partners[i], 8)]]);
  }
  drawn.sort((a, b) => b[0] - a[0]);
  for (const [, x, y, size, colour] of drawn) {
    context.fillStyle = colour;
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
}
