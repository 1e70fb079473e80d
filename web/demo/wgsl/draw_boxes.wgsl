// Boxes as solids: of each the three faces that can be seen, 18 vertices.

struct View {
  clip_from_world: mat4x4f,
  eye: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> boxes: array<f32>;
@group(0) @binding(2) var<storage, read> partners: array<u32>;

struct Vertex {
  @builtin(position) position: vec4f,
  @location(0) @interpolate(flat) colour: vec3f,
}

// Viridis, at equal distances.
const colours = array(
  vec3f(0.267, 0.005, 0.329), vec3f(0.229, 0.322, 0.546), vec3f(0.128, 0.567, 0.551),
  vec3f(0.369, 0.789, 0.383), vec3f(0.993, 0.906, 0.144));

// 0 to 8 partners, and more.
fn colour_of(count: u32) -> vec3f {
  let at = f32(min(count, 8u)) / 2.0;
  let k = min(u32(at), 3u);
  return mix(colours[k], colours[k + 1u], at - f32(k));
}

@vertex
fn draw_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) box: u32) -> Vertex {
  let lower = vec3(boxes[6u * box], boxes[6u * box + 1u], boxes[6u * box + 2u]);
  let upper = vec3(boxes[6u * box + 3u], boxes[6u * box + 4u], boxes[6u * box + 5u]);
  let axis = vertex / 6u;
  // The corners of two triangles: 0 1 2, 2 1 3.
  let corner = array(0u, 1u, 2u, 2u, 1u, 3u)[vertex % 6u];
  let faces_upper = view.eye.xyz > 0.5 * (lower + upper);
  var is_upper: vec3<bool>;
  is_upper[axis] = faces_upper[axis];
  is_upper[(axis + 1u) % 3u] = (corner & 1u) != 0u;
  is_upper[(axis + 2u) % 3u] = (corner & 2u) != 0u;
  let light = array(0.82, 0.68, 1.0)[axis];
  var out: Vertex;
  out.position = view.clip_from_world * vec4(select(lower, upper, is_upper), 1.0);
  out.colour = light * colour_of(partners[box]);
  return out;
}

@fragment
fn draw_fragment(in: Vertex) -> @location(0) vec4f { return vec4(in.colour, 1.0); }
