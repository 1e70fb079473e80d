"""Triangle meshes: which triangles intersect, exactly; which are within a distance; candidates for
contact and continuous collision detection (CCD).

    >>> import numpy, throng
    >>> vertices = numpy.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [2, 1, 1.0]])
    >>> faces = numpy.array([[0, 1, 2], [3, 4, 5]])
    >>> throng.mesh.self_intersections(vertices, faces)
    array([[0, 1]], dtype=uint32)

A mesh is a tuple (vertices, faces), or an object with both, such as a trimesh.Trimesh.

vertices: (n, 3) float64 or float32. The result is that of exact arithmetic on the given numbers.
faces: (m, 3) integers of any type, 0 to n - 1: three vertices of each triangle.

Arrays are NumPy or DLPack arrays in host memory, and may be read-only. They are read in place if the
values of a row are contiguous and, for faces, have 32 bits; else they are copied. They must not
change during a call.

Triangles are closed: touching counts. In one mesh, two triangles intersect if they have a common
point outside of the convex hull of the vertices that they share by index: without a shared vertex,
any common point; with one, more than this vertex; with two, more than this edge; with three, always.
Triangles of two meshes intersect if they have any common point. Nothing is welded: vertices at the
same place with different indices are not shared.
"""

import enum
from collections.abc import Callable
from typing import Any, NamedTuple, NoReturn, Protocol, TypeAlias, Unpack

import numpy
from numpy.typing import ArrayLike, NDArray

from throng import _throng
from throng._types import Algorithm, Array, Backend, FilterArrays, Isa, Order

__all__ = [
    "ContactCandidates",
    "ContactFinder",
    "Finder",
    "Intersections",
    "Kind",
    "Mesh",
    "MeshLike",
    "contact_candidates",
    "describe",
    "intersections",
    "self_intersections",
    "within",
]

Pairs: TypeAlias = NDArray[numpy.uint32]
"""(k, 2)"""


class Mesh(Protocol):
    """An object with vertices and faces, such as a trimesh.Trimesh."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


MeshLike: TypeAlias = tuple[Array, Array] | Mesh


class Kind(enum.IntEnum):
    """How two intersecting triangles meet."""

    CROSSING = 0
    """Not in one plane, and they share a point that is on no edge of either."""
    TOUCHING = 1
    """Not in one plane otherwise."""
    COPLANAR = 2
    """All six vertices are in one plane."""
    NONE = 3
    """They do not intersect."""


class Intersections(NamedTuple):
    """The intersection of each pair of triangles: a point, a segment or a convex polygon."""

    kind: NDArray[numpy.uint8]
    """(k,): values of Kind."""
    point_count: NDArray[numpy.uint8]
    """(k,): 1 to 6; 0 of kind NONE."""
    points: NDArray[numpy.float64]
    """(k, 6, 3): the first `point_count` in order, then NaN."""


class ContactCandidates(NamedTuple):
    """Pairs of elements whose boxes overlap; each (k, 2) uint32."""

    vertex_face: Pairs
    """Vertex, face. Empty in 2-D."""
    edge_edge: Pairs
    """First < second. Empty in 2-D."""
    edge_vertex: Pairs
    """Edge, vertex. Empty in 3-D."""


class Finder:
    """Finds pairs of triangles repeatedly and keeps its memory: later calls are faster.

    order: 'any' is fastest; 'canonical': sorted by first, then second.
    algorithm: 'auto', 'all-pairs', 'grid'. The pairs are the same for each.
    threads: maximum number; 0: one per processor.
    backend: 'auto', 'cpu'; 'cuda': intersections on a GPU, in a build with CUDA; 'emulated': the GPU
        pipeline on the CPU, slow, for tests. within needs the CPU.
    isa: the instruction set; 'auto': the widest available.
    memory_cap: for consume: limit of all memory of the library, in bytes; 0: no cap.

    One thread at a time; a call during another one raises RuntimeError. It cannot be copied or
    pickled.
    """

    def __init__(
        self,
        *,
        order: Order = "any",
        algorithm: Algorithm = "auto",
        threads: int = 0,
        backend: Backend = "auto",
        isa: Isa = "auto",
        memory_cap: int = 0,
    ) -> None:
        self._finder = _throng.MeshFinder(order, algorithm, backend, isa, threads, memory_cap, False)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Finder cannot be copied or pickled: make another, throng.mesh.Finder(...) with the "
            "same options"
        )

    def self_intersections(
        self, mesh: MeshLike | Array, faces: Array | None = None, **filters: Unpack[FilterArrays]
    ) -> Pairs:
        """As throng.mesh.self_intersections. The memory of a released result is reused later."""
        own, _ = _filters(filters, "self_intersections", None)
        return self._finder.find(_mesh(mesh, faces), None, None, own, _NO_FILTERS)

    def intersections(
        self,
        mesh: MeshLike,
        other: MeshLike,
        *,
        transform: ArrayLike | None = None,
        other_transform: ArrayLike | None = None,
        **filters: Unpack[FilterArrays],
    ) -> Pairs:
        """As throng.mesh.intersections. The memory of a released result is reused later."""
        own, others = _filters(filters, "intersections", other)
        a = _mesh(mesh, None, transform)
        b = _mesh(other, None, other_transform, "other")
        return self._finder.find(a, b, None, own, others)

    def within(
        self,
        mesh: MeshLike,
        other: MeshLike | None = None,
        *,
        distance: float,
        transform: ArrayLike | None = None,
        other_transform: ArrayLike | None = None,
        **filters: Unpack[FilterArrays],
    ) -> Pairs:
        """As throng.mesh.within. The memory of a released result is reused later."""
        own, others = _filters(filters, "within", other)
        a = _mesh(mesh, None, transform)
        b = _second(other, other_transform)
        return self._finder.find(a, b, _distance(distance), own, others)

    def consume(
        self,
        mesh: MeshLike,
        callback: Callable[[Pairs], object],
        other: MeshLike | None = None,
        *,
        distance: float | None = None,
        transform: ArrayLike | None = None,
        other_transform: ArrayLike | None = None,
        **filters: Unpack[FilterArrays],
    ) -> _throng.MeshResult:
        """Passes the pairs to callback(pairs) in blocks, (k, 2) uint32, and stores no others.

        distance: None: intersections; else pairs within this distance.

        The callback runs on a thread of the library, one call at a time. If it returns a false value
        other than None, the search stops; its exceptions propagate.
        """
        own, others = _filters(filters, "consume", other)
        a = _mesh(mesh, None, transform)
        b = _second(other, other_transform)
        self._finder.consume(a, callback, b, distance, own, others)
        return self._finder.result

    @property
    def result(self) -> _throng.MeshResult:
        """The last call's counts, plan and times."""
        return self._finder.result

    @property
    def memory_bytes(self) -> int:
        """Bytes of the library's workspace."""
        return self._finder.memory_bytes


def self_intersections(
    mesh: MeshLike | Array,
    faces: Array | None = None,
    *,
    order: Order = "any",
    algorithm: Algorithm = "auto",
    threads: int = 0,
    backend: Backend = "auto",
    isa: Isa = "auto",
    **filters: Unpack[FilterArrays],
) -> Pairs:
    """The pairs of intersecting triangles of one mesh, exactly; neighbours that only share a vertex or
    an edge are no pairs.

    mesh, faces: vertices and faces, or one mesh.
    order: 'any' is fastest; 'canonical': sorted by first, then second.
    threads: maximum number; 0: one per processor.
    backend, isa: as for throng.mesh.Finder.
    group, mask, owner, world, static: filters as for find_pairs, one value per triangle.

    Returns (k, 2) uint32, indices of triangles, first < second, each pair once.

    Raises TypeError (not an array, wrong type), ValueError (wrong shape, an index out of range, a NaN or
    an infinity in a vertex that a triangle uses), MemoryError. The message names the first. Releases
    the GIL; Ctrl-C interrupts a long search.
    """
    own, _ = _filters(filters, "self_intersections", None)
    finder = _throng.MeshFinder(order, algorithm, backend, isa, threads, 0, True)
    return finder.find(_mesh(mesh, faces), None, None, own, _NO_FILTERS)


def intersections(
    mesh: MeshLike,
    other: MeshLike,
    *,
    transform: ArrayLike | None = None,
    other_transform: ArrayLike | None = None,
    order: Order = "any",
    algorithm: Algorithm = "auto",
    threads: int = 0,
    backend: Backend = "auto",
    isa: Isa = "auto",
    **filters: Unpack[FilterArrays],
) -> Pairs:
    """The pairs of a triangle of `mesh` and one of `other` that have a common point, exactly.

    transform, other_transform: (4, 4) or (3, 4), applied to the vertices of a mesh in float64, each
        operation rounded to nearest; the result is exact for the rounded vertices.
    Filters of the second mesh begin with other_. The other arguments are those of self_intersections.

    Returns (k, 2) uint32: a triangle of `mesh`, a triangle of `other`.
    """
    own, others = _filters(filters, "intersections", other)
    finder = _throng.MeshFinder(order, algorithm, backend, isa, threads, 0, True)
    a = _mesh(mesh, None, transform)
    return finder.find(a, _mesh(other, None, other_transform, "other"), None, own, others)


def within(
    mesh: MeshLike,
    other: MeshLike | None = None,
    *,
    distance: float,
    transform: ArrayLike | None = None,
    other_transform: ArrayLike | None = None,
    order: Order = "any",
    algorithm: Algorithm = "auto",
    threads: int = 0,
    isa: Isa = "auto",
    **filters: Unpack[FilterArrays],
) -> Pairs:
    """The pairs of triangles at most `distance` apart, in the units of the vertices.

    In one mesh only triangles without a shared vertex. Every pair within the distance is found; a pair
    that is farther apart by less than one part in 10**12 may be found. The other arguments are those of
    intersections; the search runs on the CPU.

    Returns (k, 2) uint32; in one mesh first < second.
    """
    own, others = _filters(filters, "within", other)
    finder = _throng.MeshFinder(order, algorithm, "cpu", isa, threads, 0, True)
    a = _mesh(mesh, None, transform)
    return finder.find(a, _second(other, other_transform), _distance(distance), own, others)


def describe(
    pairs: Array,
    mesh: MeshLike,
    other: MeshLike | None = None,
    *,
    transform: ArrayLike | None = None,
    other_transform: ArrayLike | None = None,
    threads: int = 0,
) -> Intersections:
    """How and where each of these pairs of triangles intersects.

    pairs: (k, 2) integers, as from self_intersections(mesh), or intersections(mesh, other).
    transform, other_transform: those of the search. Without them most pairs are of Kind.NONE.

    Kinds and numbers of points are exact. Each coordinate of a point is the exact one, rounded to
    the nearest double: equal points have equal coordinates in all pairs.
    """
    a = _mesh(mesh, None, transform)
    b = _second(other, other_transform)
    return Intersections(*_throng.describe_intersections(pairs, a, b, threads))


class ContactFinder:
    """Finds candidates repeatedly and keeps its memory: later calls are faster.

    order, threads, isa: as for throng.mesh.Finder. One thread at a time. It cannot be copied or pickled.
    """

    def __init__(self, *, order: Order = "any", threads: int = 0, isa: Isa = "auto") -> None:
        self._finder = _throng.ContactFinder(order, isa, threads)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a ContactFinder cannot be copied or pickled: make another, throng.mesh.ContactFinder(...) "
            "with the same options"
        )

    def find(
        self,
        vertices_t0: Array,
        vertices_t1: Array | None,
        edges: Array | None,
        faces: Array | None,
        radius: float,
        *,
        rings: int = 0,
        group: Array | None = None,
        mask: Array | None = None,
        dimension: int | None = None,
    ) -> ContactCandidates:
        """As contact_candidates."""
        return ContactCandidates(
            *self._finder.find(
                vertices_t0, vertices_t1, edges, faces, radius, dimension, rings, group, mask
            )
        )

    @property
    def result(self) -> _throng.Result:
        """The last call's counts, plan and times."""
        return self._finder.result

    @property
    def memory_bytes(self) -> int:
        """Bytes of the library's workspace."""
        return self._finder.memory_bytes


def contact_candidates(
    vertices_t0: Array,
    vertices_t1: Array | None,
    edges: Array | None,
    faces: Array | None,
    radius: float,
    *,
    rings: int = 0,
    group: Array | None = None,
    mask: Array | None = None,
    dimension: int | None = None,
    order: Order = "any",
    threads: int = 0,
    isa: Isa = "auto",
) -> ContactCandidates:
    """Candidates for contact and continuous collision detection: in 3-D pairs of a vertex and a face and
    of two edges, in 2-D of an edge and a vertex, whose boxes overlap.

    vertices_t0, vertices_t1: (n, 3), or (n, 2) for 2-D, float64 or float32. Each vertex moves along a
        line from its place in vertices_t0 to that in vertices_t1; None: nothing moves.
    edges, faces: (k, 2) and (m, 3) integers; None: there are none.
    radius: half of the distance at which two elements become candidates. The box of an element contains
        its vertices at both times, enlarged by `radius` on every side, rounded outward to float32.
    rings: elements that share a vertex are no candidates. With n rings, neither are elements of which
        two vertices are joined by at most n edges.
    group, mask: (n,) uint32: two vertices a, b may collide if (group a & mask b) and (group b & mask a)
        are nonzero; two elements are candidates if any two of their vertices may collide.
    dimension: 2 for vertices of shape (n, 3) whose z is not used; None: that of the vertices.

    Raises TypeError, ValueError and MemoryError as self_intersections does.
    """
    finder = ContactFinder(order=order, threads=threads, isa=isa)
    return finder.find(
        vertices_t0,
        vertices_t1,
        edges,
        faces,
        radius,
        rings=rings,
        group=group,
        mask=mask,
        dimension=dimension,
    )


_FILTERS = ("group", "mask", "owner", "world", "static")
_NO_FILTERS: "_throng.Filters" = (None, None, None, None, None)


def _filters(given: Any, function: str, other: object) -> "tuple[_throng.Filters, _throng.Filters]":
    """Those of the first and of the second mesh."""
    for name, value in given.items():
        is_other = name.startswith("other_")
        if name.removeprefix("other_") not in _FILTERS or (is_other and function == "self_intersections"):
            raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")
        if is_other and value is not None and other is None:
            raise ValueError(f"other: found None, wanted a second mesh for the filter {name}")
    group, mask, owner, world, static = (given.get(name) for name in _FILTERS)
    others = [given.get("other_" + name) for name in _FILTERS]
    return (group, mask, owner, world, static), (others[0], others[1], others[2], others[3], others[4])


def _distance(value: float) -> float:
    if value is None:
        raise TypeError("distance: found None, wanted a number")
    return value


def _second(mesh: MeshLike | None, transform: ArrayLike | None) -> "_throng.MeshArrays | None":
    if mesh is not None:
        return _mesh(mesh, None, transform, "other")
    if transform is not None:
        raise ValueError("other: found None, wanted a second mesh for other_transform")
    return None


def _mesh(
    mesh: Any, faces: Any = None, transform: ArrayLike | None = None, name: str = "mesh"
) -> "_throng.MeshArrays":
    rows = _rows(transform, "transform" if name == "mesh" else f"{name}_transform")
    if faces is not None:
        return mesh, faces, rows
    if isinstance(mesh, tuple):
        if len(mesh) != 2:
            raise ValueError(f"{name}: found a tuple of {len(mesh)}, wanted (vertices, faces)")
        return mesh[0], mesh[1], rows
    for attribute in ("faces", "triangles"):  # of trimesh, of Open3D
        if hasattr(mesh, "vertices") and hasattr(mesh, attribute):
            return _array(mesh.vertices), _array(getattr(mesh, attribute)), rows
    raise TypeError(
        f"{name}: found a {type(mesh).__name__}, wanted (vertices, faces), or an object with vertices and "
        "faces, such as a trimesh.Trimesh"
    )


def _array(value: Any) -> Any:
    return value if hasattr(value, "__dlpack__") else numpy.asarray(value)


def _rows(transform: ArrayLike | None, name: str) -> tuple[float, ...] | None:
    """The 12 numbers of the first three rows."""
    if transform is None:
        return None
    matrix = numpy.asarray(transform)
    wanted = "numbers of shape (4, 4) or (3, 4)"
    if matrix.dtype.kind not in "fiu":
        raise TypeError(f"{name}: found {matrix.dtype} of shape {matrix.shape}, wanted {wanted}")
    if matrix.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"{name}: found shape {matrix.shape}, wanted {wanted}")
    matrix = matrix.astype(numpy.float64)
    if len(matrix) == 4 and matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError(f"{name}: found the last row {matrix[3].tolist()}, wanted [0, 0, 0, 1]")
    if not numpy.isfinite(matrix).all():
        raise ValueError(f"{name}: found a value that is not finite, wanted finite numbers")
    numbers: list[float] = matrix[:3].reshape(-1).tolist()
    return tuple(numbers)
