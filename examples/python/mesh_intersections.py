"""Triangle meshes: where a mesh intersects itself or another one, and what is near."""

# snippet-begin: self
import numpy
import throng.mesh

# vertices: (n, 3) float; faces: (m, 3) integers
vertices = numpy.array([
    [0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4],  # a tetrahedron
    [1, 1, -1], [2.5, 1, -1], [1, 2.5, -1], [1, 1, 0.5],  # and one that sticks through its bottom
])
tetrahedron = numpy.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
faces = numpy.concatenate([tetrahedron, tetrahedron + 4])
for first, second in throng.mesh.self_intersections(vertices, faces, order="canonical"):
    print(first, "intersects", second)
# snippet-end: self

pairs = throng.mesh.self_intersections(vertices, faces, order="canonical")
assert pairs.tolist() == [[0, 5], [0, 6], [0, 7]]

# snippet-begin: short
# vertices: (n, 3); faces: (m, 3); or one mesh, such as a trimesh.Trimesh
pairs = throng.mesh.self_intersections(vertices, faces)
print(f"{len(pairs)} pairs of triangles intersect" if len(pairs) else "the mesh is clean")
# snippet-end: short

robot = shelf = (vertices, faces)
# snippet-begin: two
up = numpy.eye(4)
up[2, 3] = 1.5  # (rotation | translation), applied to the vertices of `robot`
hits = throng.mesh.intersections(robot, shelf, transform=up)  # a triangle of `robot`, one of `shelf`
near = throng.mesh.within(robot, shelf, transform=up, distance=2.5)  # at most 2.5 apart
own = throng.mesh.within(robot, distance=2.5)  # without neighbors that share a vertex
# snippet-end: two
assert 0 < len(hits) < len(near) and len(own) > len(pairs)

# snippet-begin: keep
intact = numpy.delete(faces, numpy.unique(pairs), axis=0)  # the mesh without all triangles that intersect
# snippet-end: keep
assert len(intact) == 4
