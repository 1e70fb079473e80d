"""Kinds and segments of intersections, a Finder per frame, candidates for continuous collision detection."""

import numpy
import throng
from numpy.typing import NDArray


def sheet(n: int) -> tuple[NDArray[numpy.float64], NDArray[numpy.int64]]:
    """n * n vertices one unit apart, in squares of two triangles."""
    x, y = numpy.meshgrid(numpy.arange(n), numpy.arange(n), indexing="ij")
    corner = (numpy.arange(n - 1)[:, None] * n + numpy.arange(n - 1)).reshape(-1, 1)
    faces = numpy.concatenate([corner + [0, 1, n], corner + [1, n + 1, n]])
    return numpy.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(float), faces


flat_vertices, faces = sheet(20)

# snippet-begin: describe
# A sheet that is rolled up, so that its ends go through one another.
angle = 0.4 * flat_vertices[:, 0]
vertices = numpy.stack([3 * numpy.cos(angle), flat_vertices[:, 1] + 0.1 * angle, 3 * numpy.sin(angle)], axis=1)
vertices[:, 0] *= 1 + 0.02 * numpy.sin(3 * angle)

pairs = throng.mesh.self_intersections(vertices, faces)  # (k, 2) uint32; neighbours are no pairs
found = throng.mesh.describe(pairs, (vertices, faces))
crossing = pairs[found.kind == throng.mesh.Kind.CROSSING]
segments = found.points[found.point_count == 2, :2]  # (s, 2, 3): ends of the segments of intersection
# snippet-end: describe
assert len(pairs) > 10 and len(crossing) > 10 and len(segments) > 10

# snippet-begin: finder
# Each frame of a simulation: a Finder keeps its memory.
finder = throng.mesh.Finder()
for frame in range(3):
    vertices[:, 2] *= 0.9
    pairs = finder.self_intersections(vertices, faces)
print(finder.result.candidates, "pairs of boxes,", len(pairs), "pairs of triangles")
# snippet-end: finder

# snippet-begin: contact
# Candidates for continuous collision detection: each vertex moves along a line.
corners = numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
edges = numpy.unique(numpy.sort(corners, axis=1), axis=0)
end = vertices + [0, 0, -0.1] * numpy.sign(vertices[:, 2:])
candidates = throng.mesh.contact_candidates(vertices, end, edges, faces, radius=0.01)
vertex, face = candidates.vertex_face.T
first, second = candidates.edge_edge.T
# snippet-end: contact
assert len(vertex) > 0 and (first < second).all()
assert not (faces[face] == vertex[:, None]).any()  # a vertex and its own face are no candidate
