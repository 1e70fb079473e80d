"""throng.ipc compared with the broad phases of ipctk, on the same moving meshes; skipped without ipctk."""

from collections.abc import Callable
from typing import Any

import numpy
import pytest

ipctk = pytest.importorskip("ipctk", reason="ipctk is not installed")

import throng.ipc  # noqa: E402: after the check above

KINDS = ["vertex_vertex", "edge_vertex", "edge_edge", "face_vertex", "edge_face", "face_face"]
# Those that an ordinary step needs are rounded outward to float32.
ROUNDED = {3: ["edge_edge", "face_vertex"], 2: ["edge_vertex"]}
IDS = {
    "vertex_vertex": ("vertex0_id", "vertex1_id"),
    "edge_vertex": ("edge_id", "vertex_id"),
    "edge_edge": ("edge0_id", "edge1_id"),
    "face_vertex": ("face_id", "vertex_id"),
    "edge_face": ("edge_id", "face_id"),
    "face_face": ("face0_id", "face1_id"),
}


def pairs_of(kind: str, candidates: Any) -> list[tuple[int, int]]:
    """Sorted; of two elements of one kind the smaller first."""
    first, second = IDS[kind]
    pairs = [(getattr(c, first), getattr(c, second)) for c in candidates]
    same = kind.split("_")[0] == kind.split("_")[1]
    pairs = [(min(p), max(p)) if same else p for p in pairs]
    assert len(pairs) == len(set(pairs))
    return sorted(pairs)


def detected(broad_phase: Any) -> dict[str, list[tuple[int, int]]]:
    return {kind: pairs_of(kind, getattr(broad_phase, f"detect_{kind}_candidates")()) for kind in KINDS}


def compare(own: Any, other: Any, dimension: int) -> None:
    """The same pairs; of the rounded kinds possibly more."""
    found, wanted = detected(own), detected(other)
    for kind in KINDS:
        if kind in ROUNDED[dimension]:
            assert set(wanted[kind]) <= set(found[kind]), kind
            assert len(found[kind]) <= len(wanted[kind]) * 1.01 + 2, kind
        else:
            assert found[kind] == wanted[kind], kind


def soup(seed: int, dimension: int = 3) -> tuple[Any, Any, Any, Any]:
    random = numpy.random.default_rng(seed)
    t0 = random.random((60, dimension))
    faces = random.permutation(60).reshape(-1, 3).astype(numpy.int32)
    faces = numpy.vstack([faces, random.permutation(60).reshape(-1, 3)]).astype(numpy.int32)
    return t0, t0 + 0.1 * random.standard_normal(t0.shape), ipctk.edges(faces), faces


def sheets(n: int, seed: int) -> tuple[Any, Any, Any, Any]:
    """Two parallel sheets that move through one another."""
    random = numpy.random.default_rng(seed)
    x, y = numpy.meshgrid(numpy.arange(n, dtype=float), numpy.arange(n, dtype=float), indexing="ij")
    corner = (numpy.arange(n - 1)[:, None] * n + numpy.arange(n - 1)).reshape(-1, 1)
    one = numpy.concatenate([corner + [0, 1, n], corner + [1, n + 1, n]])
    low = numpy.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    faces = numpy.concatenate([one, one + n * n]).astype(numpy.int32)
    t0 = numpy.concatenate([low, low + [0.3, 0.2, 0.5]]) + 0.05 * random.standard_normal((2 * n * n, 3))
    t1 = t0 + numpy.repeat([[0, 0, 0.4], [0, 0, -0.4]], n * n, axis=0)
    return t0, t1, ipctk.edges(faces), faces


SCENES: list[Callable[[], tuple[Any, Any, Any, Any]]] = [
    lambda: soup(1),
    lambda: soup(2),
    lambda: sheets(7, 1),
    lambda: sheets(12, 2),
]


@pytest.mark.parametrize("scene", range(len(SCENES)))
@pytest.mark.parametrize("other", ["BruteForce", "HashGrid", "LBVH"])
def test_candidates_of_ipctk(scene: int, other: str) -> None:
    t0, t1, edges, faces = SCENES[scene]()
    own, theirs = throng.ipc.BroadPhase(), getattr(ipctk, other)()
    for radius in (0.0, 0.01, 0.1):
        for arguments in ((t0, edges, faces, radius), (t0, t1, edges, faces, radius)):
            own.build(*arguments)
            theirs.build(*arguments)
            if other == "BruteForce":
                compare(own, theirs, 3)
                continue
            for kind in ROUNDED[3]:  # others of ipctk may have more
                own_pairs = pairs_of(kind, getattr(own, f"detect_{kind}_candidates")())
                brute = ipctk.BruteForce()
                brute.build(*arguments)
                exact = pairs_of(kind, getattr(brute, f"detect_{kind}_candidates")())
                their_pairs = pairs_of(kind, getattr(theirs, f"detect_{kind}_candidates")())
                assert set(exact) <= set(own_pairs) and set(exact) <= set(their_pairs)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_two_dimensions(seed: int) -> None:
    t0, t1, edges, _ = soup(seed, 2)
    own, theirs = throng.ipc.BroadPhase(), ipctk.BruteForce()
    no_faces = numpy.zeros((0, 3), numpy.int32)
    for arguments in ((t0, edges, no_faces, 0.05), (t0, t1, edges, no_faces, 0.05)):
        own.build(*arguments)
        theirs.build(*arguments)
        compare(own, theirs, 2)
        candidates = own.detect_collision_candidates()
        assert len(candidates.ev_candidates) > 0 and len(candidates.ee_candidates) == 0


def test_as_ipctk_uses_it() -> None:
    t0, t1, edges, faces = sheets(10, 3)
    collision_mesh = ipctk.CollisionMesh(t0, edges, faces)
    own, brute = throng.ipc.BroadPhase(), ipctk.BruteForce()
    assert own.name() == "Throng"
    for arguments in ((t0, 0.05), (t0, t1, 0.05)):
        candidates, expected = ipctk.Candidates(), ipctk.Candidates()
        candidates.build(collision_mesh, *arguments, own)
        expected.build(collision_mesh, *arguments, brute)
        assert len(expected.ee_candidates) > 100 and len(expected.fv_candidates) > 100
        for kind, attribute in (("edge_edge", "ee_candidates"), ("face_vertex", "fv_candidates")):
            wanted = set(pairs_of(kind, getattr(expected, attribute)))
            assert wanted <= set(pairs_of(kind, getattr(candidates, attribute)))
    step = candidates.compute_collision_free_stepsize(collision_mesh, t0, t1)
    assert step == expected.compute_collision_free_stepsize(collision_mesh, t0, t1) < 1
    middle = (t0 + t1) / 2
    for vertices in (t0, middle, t1):
        assert ipctk.has_intersections(collision_mesh, vertices, own) == ipctk.has_intersections(collision_mesh, vertices, brute)
    assert not ipctk.is_step_collision_free(collision_mesh, t0, t1, broad_phase=own)
    own.clear()
    assert own.detect_edge_edge_candidates() == []


def test_codimensional_elements() -> None:
    """Vertices and edges without faces: ipctk makes smaller meshes of them, with empty arrays."""
    random = numpy.random.default_rng(5)
    t0 = random.random((40, 3))
    t1 = t0 + 0.2 * random.standard_normal((40, 3))
    edges = numpy.arange(20, dtype=numpy.int32).reshape(-1, 2)
    collision_mesh = ipctk.CollisionMesh(t0, edges, numpy.zeros((0, 3), numpy.int32))
    assert collision_mesh.num_codim_vertices == 20 and collision_mesh.num_codim_edges == 10
    found, wanted = ipctk.Candidates(), ipctk.Candidates()
    found.build(collision_mesh, t0, t1, 0.05, throng.ipc.BroadPhase())
    wanted.build(collision_mesh, t0, t1, 0.05, ipctk.BruteForce())
    assert pairs_of("vertex_vertex", found.vv_candidates) == pairs_of("vertex_vertex", wanted.vv_candidates) != []
    assert pairs_of("edge_vertex", found.ev_candidates) == pairs_of("edge_vertex", wanted.ev_candidates) != []


def test_filters() -> None:
    t0, t1, edges, faces = sheets(8, 4)
    patches = numpy.repeat([0, 1], 64).astype(numpy.int32)
    own, theirs = throng.ipc.BroadPhase(), ipctk.BruteForce()
    for filter_ in (
        ipctk.make_vertex_patches_filter(patches),
        ipctk.make_static_obstacle_filter(80),
    ):
        own.can_vertices_collide = theirs.can_vertices_collide = filter_
        own.build(t0, t1, edges, faces, 0.02)
        theirs.build(t0, t1, edges, faces, 0.02)
        compare(own, theirs, 3)
    # A function of Python. ipctk's own broad phases wait for ever for the interpreter's lock there.
    theirs.can_vertices_collide = ipctk.CollisionFilter()
    theirs.build(t0, t1, edges, faces, 0.02)
    own.can_vertices_collide = ipctk.CollisionFilter(lambda a, b: a * b % 19 == 1)
    own.build(t0, t1, edges, faces, 0.02)
    unfiltered = detected(theirs)
    for kind in ("edge_face", "face_face"):
        first, second = ({"edge": edges, "face": faces}[element] for element in kind.split("_"))
        wanted = [(i, k) for i, k in unfiltered[kind] if any(a * b % 19 == 1 for a in first[i] for b in second[k])]
        found = pairs_of(kind, getattr(own, f"detect_{kind}_candidates")())
        assert found == wanted and 0 < len(wanted) < len(unfiltered[kind])
    every = throng.ipc.BroadPhase(accepts_all=True)
    every.can_vertices_collide = ipctk.CollisionFilter(lambda a, b: False)
    every.build(t0, t1, edges, faces, 0.02)
    assert len(every.detect_edge_edge_candidates()) > 0


def test_arguments_of_build() -> None:
    t0, t1, edges, faces = sheets(5, 5)
    own = throng.ipc.BroadPhase(threads=1)
    own.build(t0, t1, edges, faces, 0.1)
    moving = pairs_of("edge_edge", own.detect_edge_edge_candidates())
    own.build(vertices_t0=t0, vertices_t1=t1, edges=edges, faces=faces, inflation_radius=0.1)
    assert pairs_of("edge_edge", own.detect_edge_edge_candidates()) == moving
    own.build(t0, edges, faces)
    still = pairs_of("edge_edge", own.detect_edge_edge_candidates())
    for _ in range(2):
        own.build(t0, edges, faces=faces, inflation_radius=0)
        assert pairs_of("edge_edge", own.detect_edge_edge_candidates()) == still
    own.build(t0, t1, edges, faces)
    assert set(still) <= set(pairs_of("edge_edge", own.detect_edge_edge_candidates()))
    for arguments, named, error in (
        ((t0, edges), {}, TypeError),
        ((t0, t1, edges, faces, 0.1, 1), {}, TypeError),
        ((t0, edges, faces), {"radius": 1}, TypeError),
        ((t0, edges, faces, -1.0), {}, ValueError),
        ((t0, t1[:3], edges, faces, 0.1), {}, ValueError),
        ((t0[0], edges, faces, 0.1), {}, ValueError),
    ):
        with pytest.raises(error):
            own.build(*arguments, **named)
    broken = t1.copy()
    broken[3, 0] = numpy.nan
    own.build(t0, broken, edges, faces, 0.1)
    with pytest.raises(ValueError, match="3"):
        own.detect_edge_edge_candidates()


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("edges", [[0, 1], [-1, 2]], r"edges: row 1 is \[-1, 2\]"),
        ("faces", [[0, 1, 3]], r"faces: row 0 is \[0, 1, 3\]"),
        ("edges", [[0.0, 1.0]], "edges: found float64"),
        ("faces", [[0, 1]], r"faces: found .* of shape \(1, 2\)"),
        ("inflation_radius", numpy.inf, "inflation_radius: found inf"),
        ("inflation_radius", "x", "inflation_radius: found 'x'"),
    ],
)
def test_bad_arguments_of_build(argument: str, value: Any, message: str) -> None:
    given: dict[str, Any] = {
        "vertices": numpy.eye(3),
        "edges": [[0, 1]],
        "faces": [],
        "inflation_radius": 0.1,
    }
    broad_phase = throng.ipc.BroadPhase()
    broad_phase.build(**given)
    with pytest.raises(ValueError, match=message):
        broad_phase.build(**given | {argument: value})
