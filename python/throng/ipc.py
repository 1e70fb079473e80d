"""A broad phase for ipctk, the Python package of the IPC Toolkit.

    >>> import ipctk, throng.ipc
    >>> candidates = ipctk.Candidates()
    >>> candidates.build(mesh, vertices_t0, vertices_t1, dhat / 2, throng.ipc.BroadPhase())

ipctk takes candidates of a Python class as Python objects, at one to two microseconds each. Where there
are many, that is nearly all of the time, and ipctk.LBVH is faster. throng.mesh.contact_candidates finds
the same pairs as arrays, without that cost.

A Python function that is named `build` and has the broad phase as its first argument must not call
ipctk with it: pybind11 takes such a function for the method of this name and does not call the method.

This module needs ipctk; `import throng` does not import it.
"""

from collections.abc import Callable
from typing import Any, NoReturn

import ipctk
import numpy
from numpy.typing import NDArray

from throng._find import Finder
from throng.mesh import ContactCandidates, ContactFinder

__all__ = ["BroadPhase"]

Pairs = NDArray[numpy.uint32]


class BroadPhase(ipctk.BroadPhase):
    """Candidates by Throng, for every function of ipctk that takes a broad phase.

    accepts_all: the caller knows that can_vertices_collide accepts every pair of vertices, as it does by
        default; it is then not called. Else it is called for the vertices of each candidate, which may
        double the time.
    threads: maximum number; 0: one per processor.

    Edge-edge and face-vertex candidates, and edge-vertex ones in 2-D, are all pairs whose boxes overlap,
    without those that share a vertex. The boxes are rounded outward to float32, so that there may be more
    candidates than ipctk's own, never fewer true ones. The other candidates are those of
    ipctk.BruteForce. The order of candidates may differ from run to run.

    It keeps memory from call to call. One thread at a time.
    """

    _t0: Any
    _t1: Any
    _edges: Any
    _faces: Any
    _found: ContactCandidates | None

    def __init__(self, *, accepts_all: bool = False, threads: int = 0) -> None:
        super().__init__()
        self._accepts_all = accepts_all
        self._contact = ContactFinder(threads=threads)
        self._boxes = Finder(round="exact", threads=threads)
        self.clear()

    def __reduce__(self) -> NoReturn:
        raise TypeError("a BroadPhase cannot be copied or pickled: make another, throng.ipc.BroadPhase()")

    def name(self) -> str:
        return "Throng"

    def build(self, *args: Any, **named: Any) -> None:
        """(vertices, edges, faces, inflation_radius=0), or (vertices_t0, vertices_t1, edges, faces,
        inflation_radius=0).
        """
        t0, t1, edges, faces, radius = _arguments(args, named)
        radius = _radius(radius)
        if len(t0):
            # ipctk's own part keeps the dimension.
            none = numpy.zeros((0, 0), numpy.int32)
            super().build(numpy.asarray(t0[:1], numpy.float64), none, none, 0.0)
        self._t0, self._t1, self._radius = t0, t1, radius
        self._edges = _elements(edges, 2, "edges", len(t0))
        self._faces = _elements(faces, 3, "faces", len(t0))
        self._found = None

    def clear(self) -> None:
        nothing = numpy.zeros((0, 3))
        none = numpy.zeros((0, 0), numpy.int32)
        self._t0, self._t1, self._radius = nothing, None, 0.0
        self._edges, self._faces = none.reshape(-1, 2), none.reshape(-1, 3)
        self._found = None

    def detect_vertex_vertex_candidates(self) -> list[Any]:
        pairs = self._allowed(self._overlaps("vertex", "vertex"), "vertex", "vertex")
        return self._candidates(ipctk.VertexVertexCandidate, pairs)

    def detect_edge_vertex_candidates(self) -> list[Any]:
        pairs = self._contacts().edge_vertex if self._is_flat() else self._overlaps("edge", "vertex")
        return self._candidates(ipctk.EdgeVertexCandidate, self._allowed(pairs, "edge", "vertex"))

    def detect_edge_edge_candidates(self) -> list[Any]:
        pairs = self._overlaps("edge", "edge") if self._is_flat() else self._contacts().edge_edge
        return self._candidates(ipctk.EdgeEdgeCandidate, self._allowed(pairs, "edge", "edge"))

    def detect_face_vertex_candidates(self) -> list[Any]:
        if self._is_flat():
            pairs = self._overlaps("face", "vertex")
        else:
            pairs = self._contacts().vertex_face[:, ::-1]
        return self._candidates(ipctk.FaceVertexCandidate, self._allowed(pairs, "face", "vertex"))

    def detect_edge_face_candidates(self) -> list[Any]:
        pairs = self._allowed(self._overlaps("edge", "face"), "edge", "face")
        return self._candidates(ipctk.EdgeFaceCandidate, pairs)

    def detect_face_face_candidates(self) -> list[Any]:
        pairs = self._allowed(self._overlaps("face", "face"), "face", "face")
        return self._candidates(ipctk.FaceFaceCandidate, pairs)

    def _is_flat(self) -> bool:
        return bool(self._t0.shape[1] == 2)

    def _contacts(self) -> ContactCandidates:
        """The candidates that the dimension needs, by one search."""
        if self._found is None:
            self._found = self._contact.find(
                self._t0, self._t1, self._edges, self._faces, self._radius
            )
        return self._found

    def _vertices(self, element: str) -> NDArray[Any]:
        """(m, 1), (m, 2) or (m, 3): the vertices of each element."""
        rows: NDArray[Any] = self._edges if element == "edge" else self._faces
        if element == "vertex":
            rows = numpy.arange(len(self._t0), dtype=numpy.int32)[:, None]
        return rows

    def _boxes_of(self, element: str) -> tuple[NDArray[Any], NDArray[Any]]:
        """ipctk's boxes: one step of float64 larger than the radius on every side."""
        t1 = self._t0 if self._t1 is None else self._t1
        lower = numpy.nextafter(numpy.minimum(self._t0, t1) - self._radius, -numpy.inf)
        upper = numpy.nextafter(numpy.maximum(self._t0, t1) + self._radius, numpy.inf)
        rows = self._vertices(element)
        return lower[rows].min(axis=1), upper[rows].max(axis=1)

    def _overlaps(self, first: str, second: str) -> Pairs:
        """Pairs of elements whose boxes overlap and that share no vertex."""
        a = self._boxes_of(first)
        pairs: Pairs = self._boxes.find(a, None if first == second else self._boxes_of(second))
        u, v = self._vertices(first)[pairs[:, 0]], self._vertices(second)[pairs[:, 1]]
        shared = (u[:, :, None] == v[:, None, :]).any(axis=(1, 2))
        apart: Pairs = pairs[~shared]
        return apart

    def _allowed(self, pairs: Pairs, first: str, second: str) -> Pairs:
        """Those of which can_vertices_collide accepts any two vertices."""
        if self._accepts_all or len(pairs) == 0:
            return pairs
        accepts: Callable[[int, int], bool] = self.can_vertices_collide
        u, v = self._vertices(first)[pairs[:, 0]], self._vertices(second)[pairs[:, 1]]
        allowed = numpy.zeros(len(pairs), bool)
        for i in range(u.shape[1]):
            for k in range(v.shape[1]):
                (left,) = numpy.nonzero(~allowed)
                answers = map(accepts, u[left, i].tolist(), v[left, k].tolist())
                allowed[left] = numpy.fromiter(answers, bool, len(left))
        kept: Pairs = pairs[allowed]
        return kept

    @staticmethod
    def _candidates(kind: Callable[[int, int], Any], pairs: Pairs) -> list[Any]:
        return list(map(kind, pairs[:, 0].tolist(), pairs[:, 1].tolist()))


def _arguments(args: tuple[Any, ...], named: dict[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
    """vertices_t0, vertices_t1 or None, edges, faces, radius, of either form of build."""
    is_static = "vertices" in named or "vertices_t1" not in named and (
        len(args) < 4 or numpy.ndim(args[3]) == 0
    )
    names = ["edges", "faces", "inflation_radius"]
    names = ["vertices", *names] if is_static else ["vertices_t0", "vertices_t1", *names]
    if len(args) > len(names):
        raise TypeError(f"build: found {len(args)} arguments, wanted {', '.join(names)}")
    given = dict(zip(names, args))
    for name, value in named.items():
        if name not in names or name in given:
            raise TypeError(f"build: found the argument {name!r}, wanted {', '.join(names)}")
        given[name] = value
    given.setdefault("inflation_radius", 0.0)
    missing = [name for name in names if name not in given]
    if missing:
        raise TypeError(f"build: {', '.join(missing)} missing")
    # Copies: ipctk's arrays may end with the call; and contiguous rows, which are searched in place.
    arrays = [numpy.array(given[name], order="C") for name in names[:-1]]
    first = arrays[0]
    if first.ndim != 2 or first.shape[1] not in (2, 3):
        raise ValueError(f"{names[0]}: found shape {first.shape}, wanted (n, 3), or (n, 2) for 2-D")
    t1 = None if is_static else arrays[1]
    if t1 is not None and t1.shape != first.shape:
        raise ValueError(f"vertices_t1: found shape {t1.shape}, wanted {first.shape} as vertices_t0")
    return first, t1, arrays[-2], arrays[-1], given["inflation_radius"]


def _radius(value: Any) -> float:
    try:
        radius = float(value)
    except (TypeError, ValueError):
        radius = numpy.nan
    if not 0 <= radius < numpy.inf:
        raise ValueError(f"inflation_radius: found {value!r}, wanted a finite number of 0 or more")
    return radius


def _elements(rows: NDArray[Any], size: int, name: str, vertices: int) -> NDArray[Any]:
    """The vertices of each edge or face, (n, size)."""
    if rows.size == 0:
        return numpy.zeros((0, size), numpy.int32)
    if rows.ndim != 2 or rows.shape[1] != size or rows.dtype.kind not in "iu":
        raise ValueError(
            f"{name}: found {rows.dtype} of shape {rows.shape}, wanted integers of shape (n, {size})"
        )
    bad = numpy.flatnonzero(((rows < 0) | (rows >= vertices)).any(axis=1))
    if len(bad):
        raise ValueError(
            f"{name}: row {bad[0]} is {rows[bad[0]].tolist()}, wanted indices of the {vertices} vertices "
            f"({len(bad)} bad rows)"
        )
    return rows
