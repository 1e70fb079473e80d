"""throng.mesh against the rules in exact rational numbers; its arguments."""

import copy
import json
import os
import pickle
import threading
from fractions import Fraction
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy
import pytest
from dlpack import CUDA, ArrayOnDevice, OnlyDLPack
from hypothesis import given, settings
from hypothesis import strategies as st
from interrupt import ctrl_c
from mesh_oracle import apart, intersections, self_intersections, triangles_of
from numpy.lib.stride_tricks import as_strided
from reference import INF, NAN, as_pairs

import throng
from throng import _throng, mesh
from throng.mesh import Kind

EXAMPLES = settings(max_examples=int(os.environ.get("THRONG_EXAMPLES", "60")), deadline=None)

# Two triangles that cross, and one that is apart.
VERTICES = numpy.array(
    [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [2, 1, 1], [9, 9, 9], [9, 8, 9], [8, 9, 9]], float
)
FACES = numpy.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]])
PAIRS = [(0, 1)]

# Few values, so that triangles touch, fold, coincide, and have no area.
grid = st.integers(-2, 2).map(float)
nearly = st.sampled_from([-1.0, -1e-45, 0.0, 1e-45, 0.1, 0.5, 0.5000000000000001, 1.0, 1e7, 1e38])
wild = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def meshes(draw: Any, most: int = 7) -> Any:
    """(vertices, faces); the three indices of a face differ."""
    value = draw(st.sampled_from([grid, nearly, wild]))
    rows = draw(st.lists(st.tuples(value, value, value), min_size=3, max_size=8))
    index = st.integers(0, len(rows) - 1)
    face = st.lists(index, min_size=3, max_size=3, unique=True)
    faces = draw(st.lists(face, max_size=most))
    return numpy.array(rows), numpy.array(faces, numpy.int64).reshape(-1, 3)


@EXAMPLES
@given(meshes())
def test_self_intersections(one: Any) -> None:
    vertices, faces = one
    assert as_pairs(mesh.self_intersections(vertices, faces)) == self_intersections(vertices, faces)
    with numpy.errstate(over="ignore"):
        floats = numpy.nan_to_num(vertices.astype(numpy.float32))
    assert as_pairs(mesh.self_intersections(floats, faces)) == self_intersections(floats, faces)


@EXAMPLES
@given(meshes(4), meshes(4))
def test_intersections(a: Any, b: Any) -> None:
    wanted = intersections(a, b)
    assert as_pairs(mesh.intersections(a, b)) == wanted
    with numpy.errstate(over="ignore"):
        c = numpy.nan_to_num(b[0].astype(numpy.float32)), b[1]
    assert as_pairs(mesh.intersections(a, c)) == intersections(a, c)
    every = list(product(range(len(a[1])), range(len(b[1]))))
    found = mesh.describe(numpy.array(every, numpy.uint32).reshape(-1, 2), a, b)
    assert found.kind.dtype == found.point_count.dtype == numpy.uint8 and found.points.dtype == numpy.float64
    assert [pair for pair, count in zip(every, found.point_count) if count] == wanted


@EXAMPLES
@given(meshes(5), st.sampled_from([0.0, 0.5, 1.0, 1.5]))
def test_within(one: Any, distance: float) -> None:
    vertices, faces = numpy.clip(one[0], -1e9, 1e9), one[1]
    triangles = triangles_of(vertices, faces)
    least, most = Fraction(distance) ** 2, (Fraction(distance) * (1 + Fraction(1, 10**12))) ** 2
    found = as_pairs(mesh.within((vertices, faces), distance=distance))
    assert len(found) == len(set(found))
    for i, k in combinations(range(len(triangles)), 2):
        if set(faces[i].tolist()) & set(faces[k].tolist()):
            assert (i, k) not in found
            continue
        squared = apart(triangles[i], triangles[k])
        assert (i, k) in found if squared <= least else squared <= most or (i, k) not in found
    both = set(as_pairs(mesh.within((vertices, faces), (vertices, faces), distance=distance)))
    assert {(i, i) for i in range(len(faces))} | set(found) <= both


def test_known_cases() -> None:
    folder = os.environ.get("THRONG_DATA")
    if not folder or not (Path(folder) / "triangles.json").is_file():
        pytest.skip("THRONG_DATA has no triangles.json")
    cases = json.loads((Path(folder) / "triangles.json").read_text())
    assert len(cases) > 10
    for case in cases:
        for kind, key in ((numpy.float32, "pairs_float32"), (numpy.float64, "pairs_float64")):
            vertices, faces = numpy.array(case["vertices"], kind), numpy.array(case["triangles"])
            found = as_pairs(mesh.self_intersections(vertices, faces))
            assert found == [tuple(pair) for pair in case[key]], case["name"]
            assert found == self_intersections(vertices, faces), case["name"]


def sheet(n: int, height: float = 0.0) -> tuple[Any, Any]:
    """n * n vertices, in squares of two triangles."""
    x, y = numpy.meshgrid(numpy.arange(n, dtype=float), numpy.arange(n, dtype=float), indexing="ij")
    corner = (numpy.arange(n - 1)[:, None] * n + numpy.arange(n - 1)).reshape(-1, 1)
    faces = numpy.concatenate([corner + [0, 1, n], corner + [1, n + 1, n]])
    return numpy.stack([x, y, numpy.full_like(x, height)], axis=-1).reshape(-1, 3), faces


def test_neighbours_are_no_pairs() -> None:
    vertices, faces = sheet(30)
    assert len(mesh.self_intersections(vertices, faces)) == 0
    # Not shared by index: each triangle touches all around it.
    apart_ = vertices[faces.reshape(-1)], numpy.arange(3 * len(faces)).reshape(-1, 3)
    welded = mesh.self_intersections(*apart_, order="canonical")
    assert len(welded) > 5 * len(faces)
    finder = mesh.Finder(order="canonical")
    assert numpy.array_equal(finder.self_intersections(apart_), welded)
    assert finder.result.candidates >= finder.result.found == len(welded)
    assert finder.result.exact_tests >= 0 and finder.memory_bytes > 0
    blocks: list[Any] = []
    assert finder.consume(apart_, blocks.append).status == "ok"
    assert numpy.array_equal(numpy.concatenate(blocks), welded)
    assert finder.consume(apart_, lambda pairs: False).status == "stopped"
    for threads, algorithm in product((1, 2, 7), ("all-pairs", "grid")):
        options: Any = {"threads": threads, "algorithm": algorithm, "order": "canonical"}
        assert numpy.array_equal(mesh.self_intersections(*apart_, **options), welded)


def test_transforms() -> None:
    low, high = sheet(6), sheet(6, 2.0)
    assert len(mesh.intersections(low, high)) == 0
    down = numpy.eye(4)
    down[2, 3] = -2
    same = mesh.intersections(low, low, order="canonical")
    for transform in (down, down[:3], down.astype(int), down.tolist(), down.astype(numpy.float32)):
        assert numpy.array_equal(mesh.intersections(low, high, other_transform=transform, order="canonical"), same)
    up = numpy.linalg.inv(down)
    finder = mesh.Finder(order="canonical")
    assert numpy.array_equal(finder.intersections(low, high, transform=up), same)
    assert len(finder.within(low, high, distance=1.9)) == 0
    assert numpy.array_equal(finder.within(low, high, distance=0, transform=up), same)
    assert len(finder.within(low, high, distance=2.0)) == len(same)
    found = mesh.describe(same, low, high, other_transform=down)
    assert (found.kind == Kind.COPLANAR).all() and (found.point_count >= 1).all()
    wrong: list[tuple[Any, Any, str]] = [
        (numpy.eye(3), ValueError, r"transform: found shape \(3, 3\)"),
        ("x", TypeError, "transform: found"),
        (numpy.full((4, 4), 1.0), ValueError, "last row"),
        (numpy.full((3, 4), NAN), ValueError, "not finite"),
    ]
    for matrix, error, text in wrong:
        with pytest.raises(error, match="^" + text if text.startswith("transform") else text):
            mesh.intersections(low, high, transform=matrix)
    with pytest.raises(ValueError, match="other: found None"):
        mesh.within(low, distance=1, other_transform=down)


def test_describe() -> None:
    vertices, faces = VERTICES, numpy.vstack([FACES, [[0, 2, 1]]])
    pairs = mesh.self_intersections(vertices, faces, order="canonical")
    assert as_pairs(pairs) == [(0, 1), (0, 3), (1, 3)]
    found = mesh.describe(pairs, (vertices, faces))
    assert found.kind.tolist() == [Kind.CROSSING, Kind.COPLANAR, Kind.CROSSING]
    assert found.point_count.tolist() == [2, 3, 2] and found.points.shape == (3, 6, 3)
    crossing = sorted(found.points[0, :2].tolist())
    assert numpy.allclose(crossing, [[1, 1, 0], [1.5, 1, 0]], atol=1e-14)
    assert numpy.isnan(found.points[0, 2:]).all() and not numpy.isnan(found.points[1, :3]).any()
    for given_ in (pairs.astype(numpy.int64), numpy.repeat(pairs, 2, axis=0)[::2], numpy.asfortranarray(pairs)):
        assert numpy.array_equal(mesh.describe(given_, (vertices, faces)).kind, found.kind)
    nothing = mesh.describe(pairs[:0], (vertices, faces))
    assert nothing.kind.shape == (0,) and nothing.points.shape == (0, 6, 3)
    apart_ = mesh.describe(numpy.array([[0, 2]]), (vertices, faces))
    assert apart_.point_count.tolist() == [0] and apart_.kind.tolist() == [Kind.NONE]
    for bad in (numpy.array([[0, 4]]), numpy.array([[-1, 0]]), numpy.array([[0, 2**32]]), numpy.zeros((2, 3), int)):
        with pytest.raises(ValueError):
            mesh.describe(bad, (vertices, faces))
    with pytest.raises(TypeError, match="pairs: found float64"):
        mesh.describe(pairs.astype(float), (vertices, faces))


def test_describe_without_the_transform_of_the_search() -> None:
    away = numpy.eye(4)
    away[0, 3] = 500
    other = (VERTICES - [500, 0, 0], FACES)
    pairs = mesh.intersections((VERTICES, FACES), other, other_transform=away)
    assert len(pairs) > 0
    assert Kind.NONE not in mesh.describe(pairs, (VERTICES, FACES), other, other_transform=away).kind
    forgotten = mesh.describe(pairs, (VERTICES, FACES), other)
    assert set(forgotten.kind.tolist()) == {Kind.NONE} and not forgotten.point_count.any()


def test_repeated_indices_count_as_one_vertex() -> None:
    for a in ((1, 2, 2), (1, 1, 2), (2, 1, 2)):
        for b in ((1, 2, 2), (2, 1, 1)):
            faces = numpy.array([a, b])
            assert len(mesh.self_intersections(VERTICES, faces)) == 0
            assert self_intersections(VERTICES, faces) == []


def layouts(array: Any) -> list[Any]:
    wide = numpy.full((2 * len(array), array.shape[1] + 2), 77, array.dtype)
    wide[::2, 1:-1] = array
    frozen = array.copy()
    frozen.flags.writeable = False
    unaligned = numpy.zeros(array.nbytes + 1, numpy.uint8)[1:].view(array.dtype).reshape(array.shape)
    unaligned[:] = array
    return [
        array,
        numpy.asfortranarray(array),
        wide[::2, 1:-1],
        frozen,
        array[::-1].copy()[::-1],
        array[:, ::-1].copy()[:, ::-1],
        unaligned,
        OnlyDLPack(array),
    ]


def test_layouts_and_types() -> None:
    for kind in (numpy.float32, numpy.float64):
        for vertices in layouts(VERTICES.astype(kind)):
            assert as_pairs(mesh.self_intersections(vertices, FACES)) == PAIRS
    for kind in "bBhHiIqQ":
        for faces in layouts(FACES.astype(kind)):
            assert as_pairs(mesh.self_intersections(VERTICES, faces)) == PAIRS
            assert as_pairs(mesh.intersections((VERTICES, faces), (VERTICES, FACES))).count((0, 1)) == 1
    # Read in place: the same memory with other values gives another result.
    finder = mesh.Finder()
    vertices, faces = VERTICES.astype(numpy.float32), FACES.astype(numpy.int32)
    assert len(finder.self_intersections(vertices, faces)) == 1
    vertices[3:6] += 20
    assert len(finder.self_intersections(vertices, faces)) == 0
    # One triangle, repeated by a stride of 0, and empty meshes.
    again = as_strided(FACES.astype(numpy.uint32), (4, 3), (0, 4))
    assert len(mesh.self_intersections(VERTICES, again)) == 6
    for empty in (FACES[:0], FACES[:0].astype(numpy.uint8)):
        assert mesh.self_intersections(VERTICES, empty).shape == (0, 2)
        assert mesh.self_intersections(VERTICES[:0], empty).shape == (0, 2)
        assert mesh.intersections((VERTICES, FACES), (VERTICES, empty)).shape == (0, 2)


class Model:
    """A mesh as an object."""

    def __init__(self, vertices: Any, faces: Any) -> None:
        self.vertices, self.faces = vertices, faces


class Model3D:
    """As Open3D names them; its lists are no DLPack arrays."""

    def __init__(self, vertices: Any, triangles: Any) -> None:
        self.vertices, self.triangles = vertices, triangles


def test_objects() -> None:
    for model in (Model(VERTICES, FACES), (VERTICES, FACES), Model3D(VERTICES.tolist(), FACES.tolist())):
        one: Any = model
        assert as_pairs(mesh.self_intersections(one)) == PAIRS
        assert (0, 1) in as_pairs(mesh.intersections(one, Model(VERTICES, FACES)))
        assert len(mesh.describe(numpy.array(PAIRS), one).kind) == 1
    for wrong, error, text in (
        (VERTICES, TypeError, "^mesh: found a ndarray.*vertices, faces"),
        ((VERTICES, FACES, FACES), ValueError, "^mesh: found a tuple of 3"),
        (None, TypeError, "^mesh: found a NoneType"),
        ([[0.0, 0, 0]], TypeError, "^mesh: found a list"),
    ):
        with pytest.raises(error, match=text):
            mesh.self_intersections(wrong)  # type: ignore[arg-type]


def test_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    sphere = trimesh.creation.icosphere(subdivisions=3)
    assert len(mesh.self_intersections(sphere)) == 0
    moved = sphere.copy()
    moved.apply_translation([0.5, 0.25, 0.125])
    pairs = mesh.intersections(sphere, moved, order="canonical")
    assert len(pairs) > 50
    both = trimesh.util.concatenate([sphere, moved])
    joined = mesh.self_intersections(both, order="canonical").astype(int)
    assert (joined - [0, len(sphere.faces)]).tolist() == pairs.tolist()
    near = mesh.within(sphere, moved, distance=0.1)
    assert len(near) > len(pairs)


@EXAMPLES
@given(st.sampled_from("? b B h H i I q Q e g F D >f4 >f8 O S3 U2 M8[s]".split()), st.integers(0, 4))
def test_wrong_types_of_vertices(kind: str, n: int) -> None:
    with pytest.raises(TypeError, match="^vertices: found .*wanted"):
        mesh.self_intersections(numpy.zeros((n, 3), kind), FACES[:0])
    with pytest.raises(TypeError, match="^other_vertices: found .*wanted"):
        mesh.intersections((VERTICES, FACES), (numpy.zeros((n, 3), kind), FACES))


@EXAMPLES
@given(st.sampled_from("? e f d g F >i4 >u8 O S3 U2 M8[s]".split()), st.integers(0, 4))
def test_wrong_types_of_faces(kind: str, n: int) -> None:
    with pytest.raises(TypeError, match="^faces: found .*wanted"):
        mesh.self_intersections(VERTICES, numpy.zeros((n, 3), kind))


def test_rows_that_are_no_whole_items_apart() -> None:
    packed = numpy.zeros(3, [("position", "f8", 3), ("flag", "u1")])
    with pytest.raises(ValueError, match="numpy.ascontiguousarray"):
        throng.mesh.self_intersections(packed["position"], numpy.array([[0, 1, 2]], numpy.uint32))


def test_wrong_shapes() -> None:
    for shape in ((), (3,), (3, 2), (3, 4), (1, 3, 3)):
        with pytest.raises(ValueError, match=r"^vertices: found float64 of shape \("):
            mesh.self_intersections(numpy.zeros(shape), FACES)
        with pytest.raises(ValueError, match=r"^faces: found int64 of shape \("):
            mesh.self_intersections(VERTICES, numpy.zeros(shape, numpy.int64))
    huge = as_strided(numpy.zeros(3, numpy.uint32), (2**40, 3), (0, 4))
    with pytest.raises(ValueError, match="^faces: found 1099511627776 rows, at most 4294901760"):
        mesh.self_intersections(VERTICES, huge)
    lists: Any = VERTICES.tolist(), FACES.tolist()
    assert mesh.self_intersections(*lists).tolist() == mesh.self_intersections(VERTICES, FACES).tolist()
    texts: Any = [["a", "b", "c"]]
    with pytest.raises(TypeError, match="^vertices: found a"):
        mesh.self_intersections(texts, FACES)
    with pytest.raises(ValueError, match="^vertices: found an array on cuda:0"):
        mesh.self_intersections(ArrayOnDevice((CUDA, 0), VERTICES), FACES)
    hidden = numpy.ma.MaskedArray(VERTICES, mask=VERTICES > 8)
    with pytest.raises(ValueError, match="^vertices: found a masked array"):
        mesh.self_intersections(hidden, FACES)


@EXAMPLES
@given(st.integers(0, 2), st.integers(0, 2), st.sampled_from([-1, -(2**31), 9, 2**31 - 1, 2**32, -(2**63), 2**63 - 1]))
def test_indices_out_of_range(row: int, column: int, value: int) -> None:
    faces = FACES.copy()
    faces[row, column] = value
    kinds = [numpy.int64] + [numpy.int32] * (-(2**31) <= value < 2**31) + [numpy.uint32] * (0 <= value < 2**32)
    for kind in kinds:
        with pytest.raises(ValueError) as caught:
            mesh.self_intersections(VERTICES, faces.astype(kind))
        text = str(caught.value)
        assert str(value) in text and (f"[{row}, {column}]" in text or f"triangle {row} " in text)
        with pytest.raises(ValueError, match="second mesh|other_faces"):
            mesh.intersections((VERTICES, FACES), (VERTICES, faces.astype(kind)))


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
def test_not_finite(bad: float) -> None:
    for vertex, axis in product(range(9), range(3)):
        vertices = VERTICES.copy()
        vertices[vertex, axis] = bad
        with pytest.raises(ValueError, match=f"triangle {vertex // 3} .*vertex {vertex} "):
            mesh.self_intersections(vertices, FACES)
        unused = mesh.self_intersections(vertices, FACES[[k for k in range(3) if k != vertex // 3]])
        assert len(unused) == (1 if vertex >= 6 else 0)


def test_filters() -> None:
    vertices, faces = sheet(8)
    both = (vertices[faces.reshape(-1)], numpy.arange(3 * len(faces)).reshape(-1, 3))
    every = as_pairs(mesh.self_intersections(*both))
    owner = numpy.arange(len(faces)) % 3
    expected = [(i, k) for i, k in every if owner[i] != owner[k]]
    assert as_pairs(mesh.self_intersections(*both, owner=owner)) == expected
    group = (1 << (numpy.arange(len(faces)) % 4)).astype(numpy.uint32)
    expected = [(i, k) for i, k in every if group[i] == group[k]]
    assert as_pairs(mesh.self_intersections(*both, group=group, mask=group)) == expected
    still = numpy.arange(len(faces)) % 2 == 0
    expected = [(i, k) for i, k in every if not (still[i] and still[k])]
    assert as_pairs(mesh.self_intersections(*both, static=still)) == expected
    world = numpy.arange(len(faces)) % 2
    expected = [(i, k) for i, k in every if world[i] == world[k]]
    assert as_pairs(mesh.Finder().self_intersections(both, world=world)) == expected
    twice = as_pairs(mesh.intersections(both, both, owner=owner, other_owner=owner + 1))
    assert twice and all(owner[i] != owner[k] + 1 for i, k in twice)
    with pytest.raises(ValueError, match="^owner: found int64 of shape .3,., wanted .*one value per triangle"):
        mesh.self_intersections(*both, owner=owner[:3])
    with pytest.raises(ValueError, match="^other: found None.*other_owner"):
        mesh.within(both, distance=0, other_owner=owner)
    for name in ("other_owner", "margin"):
        wrong: Any = {name: owner}
        with pytest.raises(TypeError, match=f"unexpected keyword argument '{name}'"):
            mesh.self_intersections(*both, **wrong)


def test_options() -> None:
    for name, value, error in (
        ("order", "sorted", ValueError),
        ("algorithm", 1, TypeError),
        ("threads", -1, ValueError),
        ("backend", "gpu", ValueError),
        ("isa", "mmx", ValueError),
        ("memory_cap", "1", TypeError),
    ):
        wrong: Any = {name: value}
        with pytest.raises(error, match=f"^{name}: found"):
            mesh.Finder(**wrong)
    for bad, kind in ((-1, ValueError), (NAN, ValueError), (INF, ValueError), ("1", TypeError), (None, TypeError)):
        with pytest.raises(kind, match="^distance: found"):
            mesh.within((VERTICES, FACES), distance=bad)  # type: ignore[arg-type]
    for one in (mesh.Finder(), mesh.ContactFinder()):
        for action in (copy.copy, pickle.dumps):
            with pytest.raises(TypeError, match="cannot be copied"):
                action(one)


@EXAMPLES
@given(meshes(), meshes(4))
def test_the_emulated_device(a: Any, b: Any) -> None:
    finder = mesh.Finder(backend="emulated")
    assert as_pairs(finder.self_intersections(*a)) == self_intersections(*a)
    assert as_pairs(finder.intersections(a, b)) == intersections(a, b)
    assert finder.result.plan.backend == "emulated"
    assert as_pairs(mesh.self_intersections(*a, backend="emulated")) == self_intersections(*a)
    assert as_pairs(mesh.intersections(b, a, backend="emulated")) == intersections(b, a)


def test_backends() -> None:
    finder = mesh.Finder(backend="emulated")
    found: list[tuple[int, int]] = []
    assert finder.consume((VERTICES, FACES), lambda pairs: found.extend(as_pairs(pairs))).found == len(PAIRS)
    assert found == PAIRS
    assert finder.result.plan.backend == "emulated" and finder.result.candidates == 1
    with pytest.raises(ValueError, match="vertex 9, "):
        finder.self_intersections(VERTICES, FACES + 1)
    with pytest.raises(ValueError, match="within a distance are searched on the CPU alone; set backend to cpu"):
        finder.within((VERTICES, FACES), distance=1)
    finder = mesh.Finder()
    finder.self_intersections(VERTICES, FACES)
    assert finder.result.plan.backend == "cpu"
    if not _throng.has_cuda:
        with pytest.raises(RuntimeError, match="no GPU backend; use backend='cpu'"):
            mesh.self_intersections(VERTICES, FACES, backend="cuda")


def test_consumers() -> None:
    finder = mesh.Finder()
    lost = ValueError("of the callback")

    def fail(pairs: Any) -> None:
        raise lost

    with pytest.raises(ValueError) as caught:
        finder.consume((VERTICES, FACES), fail)
    assert caught.value is lost
    with pytest.raises(RuntimeError, match="called by its own consumer"):
        finder.consume((VERTICES, FACES), lambda pairs: finder.self_intersections(VERTICES, FACES))
    with pytest.raises(TypeError, match="^callback: found 3"):
        finder.consume((VERTICES, FACES), 3)  # type: ignore[arg-type]
    assert finder.consume((VERTICES, FACES), len, (VERTICES, FACES), distance=0).found == 5


def test_threads_of_the_caller() -> None:
    vertices, faces = sheet(40)
    soup = (vertices[faces.reshape(-1)], numpy.arange(3 * len(faces)).reshape(-1, 3))
    wanted = mesh.self_intersections(*soup, order="canonical")
    found: list[Any] = []

    def search() -> None:
        found.append(mesh.self_intersections(*soup, order="canonical"))

    threads = [threading.Thread(target=search) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 6 and all(numpy.array_equal(pairs, wanted) for pairs in found)


@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
def test_ctrl_c() -> None:
    # 200,000 triangles at the same place: 2e10 tests.
    vertices = numpy.random.default_rng(1).random((600000, 3))
    faces = numpy.arange(600000).reshape(-1, 3)
    finder = mesh.Finder(algorithm="all-pairs")
    with ctrl_c():
        finder.consume((vertices, faces), lambda pairs: None)
    assert as_pairs(finder.self_intersections(VERTICES, FACES)) == PAIRS


# ---- candidates for contact ---------------------------------------------------------------------


def rounded(x: Fraction, up: bool) -> Any:
    """The nearest float32 on that side."""
    with numpy.errstate(over="ignore"):
        nearest = numpy.float32(float(x))
    if not numpy.isfinite(nearest):
        nearest = numpy.float32(numpy.copysign(numpy.finfo(numpy.float32).max, nearest))
    while up and Fraction(float(nearest)) < x:
        nearest = numpy.nextafter(nearest, numpy.float32(INF))
    while not up and Fraction(float(nearest)) > x:
        nearest = numpy.nextafter(nearest, numpy.float32(-INF))
    return nearest


def box_of(element: Any, t0: Any, t1: Any, radius: float, axes: int) -> tuple[list[Any], list[Any]]:
    lower, upper = [], []
    for axis in range(axes):
        values = [Fraction(float(x)) for x in [*t0[element, axis], *t1[element, axis]]]
        lower.append(rounded(min(values) - Fraction(radius), False))
        upper.append(rounded(max(values) + Fraction(radius), True))
    return lower, upper


def brute_contact(
    first: Any, second: Any, t0: Any, t1: Any, radius: float, axes: int, near: Any = (), may: Any = None
) -> list[tuple[int, int]]:
    """`first` and `second`: (m, k) vertices of elements; the same array: i < k. near: pairs of vertices of
    the rings. may: whether two vertices may collide.
    """
    boxes = [[box_of(element, t0, t1, radius, axes) for element in elements] for elements in (first, second)]
    found = []
    for i, k in product(range(len(first)), range(len(second))):
        if first is second and i >= k:
            continue
        (al, au), (bl, bu) = boxes[0][i], boxes[1][k]
        overlap = all(al[x] <= bu[x] and bl[x] <= au[x] for x in range(axes))
        vertices = list(product(first[i].tolist(), second[k].tolist()))
        is_near = any(u == v or (u, v) in near for u, v in vertices)
        if overlap and not is_near and (may is None or any(may(u, v) for u, v in vertices)):
            found.append((i, k))
    return found


def edges_of(faces: Any) -> Any:
    both = numpy.sort(numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return numpy.unique(both, axis=0)


def folded_sheet(n: int, seed: int) -> tuple[Any, Any, Any, Any]:
    random = numpy.random.default_rng(seed)
    vertices, faces = sheet(n)
    vertices[:, 2] = 0.3 * random.standard_normal(len(vertices))
    vertices[:, 0] = n / 4 * numpy.sin(vertices[:, 0] / n * 5)
    return vertices, vertices + 0.4 * random.standard_normal(vertices.shape), edges_of(faces), faces


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("kind", [numpy.float64, numpy.float32])
def test_contact_candidates(seed: int, kind: Any) -> None:
    t0, t1, edges, faces = folded_sheet(6, seed)
    t0, t1 = t0.astype(kind), t1.astype(kind)
    vertex = numpy.arange(len(t0))[:, None]
    found = mesh.contact_candidates(t0, t1, edges, faces, 0.1)
    assert as_pairs(found.vertex_face) == brute_contact(vertex, faces, t0, t1, 0.1, 3) != []
    assert as_pairs(found.edge_edge) == brute_contact(edges, edges, t0, t1, 0.1, 3) != []
    assert found.edge_vertex.shape == (0, 2)
    # Warmed; nothing moves; no edges; no faces.
    finder = mesh.ContactFinder(order="canonical")
    still = finder.find(t0, None, edges, faces, 0.1)
    assert as_pairs(still.vertex_face) == brute_contact(vertex, faces, t0, t0, 0.1, 3)
    for layout in (numpy.asfortranarray(t0), t0[::-1].copy()[::-1]):
        assert numpy.array_equal(finder.find(layout, None, edges, faces, 0.1).edge_edge, still.edge_edge)
    assert numpy.array_equal(finder.find(t0, None, None, faces, 0.1).vertex_face, still.vertex_face)
    assert numpy.array_equal(finder.find(t0, None, edges, None, 0.1).edge_edge, still.edge_edge)
    assert finder.result.found == len(still.edge_edge) and finder.memory_bytes > 0
    # In 2-D.
    wanted = brute_contact(edges, vertex, t0, t1, 0.1, 2)
    for a, b, dimension in ((t0, t1, 2), (t0[:, :2], t1[:, :2], None), (t0[:, :2].copy(), t1[:, :2].copy(), 2)):
        flat = mesh.contact_candidates(a, b, edges, None, 0.1, dimension=dimension)
        assert as_pairs(flat.edge_vertex) == wanted != []
        assert len(flat.vertex_face) == len(flat.edge_edge) == 0


def test_contact_rings_and_filters() -> None:
    t0, t1, edges, faces = folded_sheet(6, 3)
    vertex = numpy.arange(len(t0))[:, None]
    near: set[tuple[int, int]] = set()
    step = {(a, b) for a, b in edges.tolist()} | {(b, a) for a, b in edges.tolist()}
    for rings in (1, 2):
        near |= step if rings == 1 else {(a, d) for a, b in near for c, d in step if b == c}
        found = mesh.contact_candidates(t0, t1, edges, faces, 0.1, rings=rings)
        assert as_pairs(found.vertex_face) == brute_contact(vertex, faces, t0, t1, 0.1, 3, near) != []
        assert as_pairs(found.edge_edge) == brute_contact(edges, edges, t0, t1, 0.1, 3, near)
    random = numpy.random.default_rng(1)
    group = random.integers(0, 8, len(t0)).astype(numpy.uint32)
    mask = random.integers(0, 8, len(t0))

    def may(u: int, v: int) -> bool:
        return bool(group[u] & mask[v]) and bool(group[v] & mask[u])

    found = mesh.contact_candidates(t0, t1, edges, faces, 0.1, group=group, mask=mask)
    assert as_pairs(found.vertex_face) == brute_contact(vertex, faces, t0, t1, 0.1, 3, (), may) != []
    assert as_pairs(found.edge_edge) == brute_contact(edges, edges, t0, t1, 0.1, 3, (), may)


def test_contact_arguments() -> None:
    t0, t1, edges, faces = folded_sheet(5, 1)
    wrong: list[tuple[dict[str, Any], Any, str]] = [
        ({"vertices_t1": t1[:-1]}, ValueError, "^vertices_t1: found 24 vertices"),
        ({"vertices_t1": t1[:, :2]}, ValueError, "^vertices_t1: found 25 vertices of 2"),
        ({"vertices_t0": t0.astype(numpy.float16)}, TypeError, "^vertices_t0: found float16"),
        ({"edges": edges[:, :1]}, ValueError, "^edges: found int64 of shape"),
        ({"edges": edges - 1}, ValueError, r"^edges: the index at \[0, 0\] is -1"),
        ({"faces": faces + 1}, ValueError, "25"),
        ({"radius": -1}, ValueError, "^radius: found -1"),
        ({"radius": NAN}, ValueError, "^radius: found nan"),
        ({"rings": -1}, ValueError, "^rings: found -1"),
        ({"dimension": 4}, ValueError, "^dimension: found 4"),
        ({"dimension": 1}, ValueError, "^dimension: found 1"),
        ({"group": numpy.zeros(3, int)}, ValueError, "^group: found int64 of shape .3,.*one value per vertex"),
    ]
    for change, error, text in wrong:
        given_ = {"vertices_t0": t0, "vertices_t1": t1, "edges": edges, "faces": faces, "radius": 0.1} | change
        with pytest.raises(error, match=text):
            mesh.contact_candidates(**given_)
    with pytest.raises(ValueError, match="^dimension: found 3, wanted 2"):
        mesh.contact_candidates(t0[:, :2], None, edges, None, 0.1, dimension=3)
    broken = t1.copy()
    broken[7, 1] = NAN
    with pytest.raises(ValueError, match="7"):
        mesh.contact_candidates(t0, broken, edges, faces, 0.1)


def test_is_exported() -> None:
    assert throng.mesh is mesh and set(mesh.__all__) <= set(dir(mesh))
