// A camera on a circle around the scene.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

export class Camera {
  angle = 0.6;
  height = 0.35;
  distance = 1;

  /** Column-major clip_from_world, and the eye. */
  view(scene, aspect) {
    const centre = scene.low.map((low, k) => low + scene.extent[k] / 2);
    const radius = Math.hypot(...scene.extent) / 2;
    const away = (radius * 2.85 * this.distance) / Math.min(1, aspect);
    const back = [Math.cos(this.height) * Math.sin(this.angle), Math.sin(this.height), Math.cos(this.height) * Math.cos(this.angle)];
    const eye = centre.map((at, k) => at + away * back[k]);
    const right = unit(cross([0, 1, 0], back));
    const up = cross(back, right);
    const near = Math.max(away - 2 * radius, away / 100);
    const far = away + 2 * radius;
    const focal = 1 / Math.tan(0.35);
    const rows = [
      [...right.map((x) => (x * focal) / aspect), (-dot(right, eye) * focal) / aspect],
      [...up.map((x) => x * focal), -dot(up, eye) * focal],
      [...back.map((x) => (x * far) / (near - far)), (-dot(back, eye) * far) / (near - far) + (near * far) / (near - far)],
      [...back.map((x) => -x), dot(back, eye)],
    ];
    const matrix = new Float32Array(16);
    rows.forEach((row, r) => row.forEach((value, c) => (matrix[4 * c + r] = value)));
    return { matrix, eye };
  }
  turn(angle, height) {
    this.angle += angle;
    this.height = Math.min(1.4, Math.max(-1.4, this.height + height));
  }
  zoom(factor) {
    this.distance = Math.min(3, Math.max(0.2, this.distance * factor));
  }
}
