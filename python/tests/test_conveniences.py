"""Worlds as an index, lists, single values, int64, float64 where float32 is kept, several threads."""

import threading
import time
from fractions import Fraction
from typing import Any

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import brute_force, double_rows

import throng

EMPTY = [1, 1, 1, 0, 0, 0]


def some_worlds(worlds: int, n: int, seed: int = 1, kind: Any = numpy.float32) -> Any:
    random = numpy.random.default_rng(seed)
    lower = random.integers(0, 9, (worlds, n, 3)).astype(kind)
    return numpy.concatenate([lower, lower + random.integers(0, 3, (worlds, n, 3)).astype(kind)], axis=2)


def triples(*worlds: Any) -> list[tuple[int, int, int]]:
    """By a double loop over each world."""
    return [(w, i, j) for w, sets in enumerate(zip(*worlds)) for i, j in brute_force(*sets)]


def rows(found: Any) -> list[tuple[int, ...]]:
    return sorted(tuple(row) for row in found.tolist())


# --- worlds


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 5), st.integers(0, 9), st.sampled_from(["f4", "f8"]), st.booleans(), st.integers(0, 99))
def test_worlds(worlds: int, n: int, kind: str, flat: bool, seed: int) -> None:
    boxes = some_worlds(worlds, n, seed, kind)
    if flat:
        boxes = boxes[:, :, [0, 1, 3, 4]]
    wanted = triples(boxes)
    d = 2 if flat else 3
    corners = boxes.reshape(worlds, n, 2, d)
    wide = numpy.zeros((worlds, 2 * n + 1, 2 * d), kind)
    wide[:, : 2 * n : 2] = boxes
    for given_ in (boxes, corners, (boxes[..., :d], boxes[..., d:]), wide[:, : 2 * n : 2]):
        found = throng.find_pairs(given_)
        assert found.dtype == numpy.uint32 and found.shape == (len(wanted), 3) and rows(found) == wanted
    in_order = throng.Finder(order="canonical").find(boxes, dtype="int64")
    assert in_order.dtype == numpy.int64 and [tuple(row) for row in in_order.tolist()] == wanted
    if wanted:
        world, first, second = in_order.T
        both = numpy.concatenate([boxes[world, first], boxes[world, second]], axis=1)
        assert both.shape == (len(wanted), 4 * d)
    if boxes.size:
        assert rows(throng.find_pairs(boxes.tolist())) == wanted


def test_worlds_of_two_sets() -> None:
    boxes, robots, ground = some_worlds(4, 15), some_worlds(4, 3, 2), some_worlds(1, 5, 3)[0]
    wanted = triples(boxes, robots)
    assert rows(throng.find_pairs(boxes, robots)) == wanted != []
    wanted = triples(boxes, [ground] * 4)
    assert rows(throng.find_pairs(boxes, ground)) == wanted != []
    only = throng.find_pairs(boxes, ground, other_world=2)
    assert rows(only) == [row for row in wanted if row[0] == 2] != []
    blocks: list[Any] = []
    finder = throng.Finder()
    assert finder.consume(boxes, blocks.append, ground).found == len(wanted)
    assert rows(numpy.concatenate(blocks)) == wanted
    assert finder.explain(boxes).result.found == len(triples(boxes))


def test_filters_of_worlds() -> None:
    boxes = numpy.zeros((3, 4, 6), numpy.float32)  # all overlap
    each = numpy.array([0, 1, 0, 1])
    owner = numpy.array([[0, 0, 1, 1], [2, 2, 2, 2], [3, 4, 5, 6]])
    same = [(w, i, j) for w, i, j in triples(boxes) if owner[w, i] != owner[w, j]]
    for values in (owner, owner.tolist(), owner.astype(numpy.int32)[:, ::1]):
        assert rows(throng.find_pairs(boxes, owner=values)) == same
    for static in (each, each.tolist(), each.astype(bool)):
        found = rows(throng.find_pairs(boxes, static=static))
        assert found == [(w, i, j) for w, i, j in triples(boxes) if not (each[i] and each[j])]
    assert len(throng.find_pairs(boxes, group=2, mask=1)) == 0
    assert len(throng.find_pairs(boxes, group=3, mask=1)) == len(triples(boxes)) == 18


def test_wrong_worlds() -> None:
    boxes = some_worlds(4, 15)

    def refuses(text: str, *args: Any, **named: Any) -> None:
        with pytest.raises(ValueError, match=text):
            throng.find_pairs(*args, **named)

    refuses("world: found a value for boxes of shape .worlds, n, ...., .*give boxes of shape .n, 6.", boxes, world=3)
    refuses(r"group: found shape \(60,\), wanted \(4, 15\), \(15,\) for each world, or one number", boxes, group=numpy.ones(60, int))
    refuses("other: found 3 worlds, and 4 worlds in boxes", boxes, boxes[:3])
    refuses("other: found 4 worlds, and boxes without worlds", boxes[0], boxes)
    refuses("other_world: found a value", boxes, boxes, other_world=1)
    refuses("lower > upper, the first is box 17", numpy.where(numpy.arange(60).reshape(4, 15, 1) == 17, EMPTY, boxes).astype("f4"))


# --- lists, single values


def test_lists() -> None:
    boxes = some_worlds(1, 40)[0]
    wanted = brute_force(boxes)
    lower, upper = boxes[:, :3].tolist(), boxes[:, 3:].tolist()
    integers = boxes.astype(int).tolist()
    bounds = list(boxes.reshape(-1, 2, 3))  # as those of meshes
    for given_ in (boxes.tolist(), tuple(boxes.tolist()), (lower, upper), integers, bounds, tuple(bounds), list(boxes)):
        assert rows(throng.find_pairs(given_)) == wanted
        live = throng.BroadPhase()
        live.add(given_)
        live.update()
        assert rows(live.pairs[:, :2]) == wanted
    two = ((0, 0, 0, 2, 2, 2), (1, 1, 1, 3, 3, 3))
    assert rows(throng.find_pairs(two)) == rows(throng.find_pairs(list(two))) == [(0, 1)]
    nothing: list[Any] = [[], ()]
    for none in nothing:
        assert throng.find_pairs(none).shape == (0, 2)
    # As float64: a tenth is not a float32.
    assert rows(throng.find_pairs([[0, 0, 0.1, 1], [0.1000000001, 0, 1, 1]])) == []
    assert rows(throng.find_pairs([[0, 0, 0.1, 1], [0.1, 0, 1, 1]])) == [(0, 1)]
    of_array = throng.update_boxes(numpy.array([[1, 2, 3]], numpy.float32), [throng.sphere(1)])
    assert numpy.array_equal(throng.update_boxes([[1, 2, 3]], [throng.sphere(1)]), of_array)


def test_one_value_for_all() -> None:
    boxes = numpy.zeros((50, 6), numpy.float32)
    everything = len(brute_force(boxes))
    for value in (4, numpy.int64(4), numpy.uint8(4), numpy.array(4)):
        assert len(throng.find_pairs(boxes, group=value)) == everything
        assert len(throng.find_pairs(boxes, group=value, mask=3)) == 0
    for world in (0, -1, 70000):
        assert len(throng.find_pairs(boxes, world=world)) == everything
    for static in (True, 1, numpy.True_, numpy.array(True)):
        assert len(throng.find_pairs(boxes, static=static)) == 0
    assert len(throng.find_pairs(boxes, owner=0)) == 0 and len(throng.find_pairs(boxes, owner=-1)) == everything
    assert throng.find_pairs(boxes[:0], owner=0).shape == (0, 2)
    with_array = throng.find_pairs(boxes, boxes[:3], group=numpy.arange(50) % 2, other_mask=1)
    assert len(with_array) == 3 * 25
    doubles = boxes.astype(float)
    assert len(throng.find_pairs(doubles, group=1, mask=2)) == 0
    for n in (20000, 3):  # with a grid, and without
        scene = throng.scene("pile", n)[0]
        for name, value in (("group", 1), ("owner", 3), ("world", 2), ("static", 1)):
            full: Any = {name: numpy.full(n, value)}
            one: Any = {name: value}
            assert rows(throng.find_pairs(scene, **one)) == rows(throng.find_pairs(scene, **full))


def test_one_object() -> None:
    live = throng.BroadPhase()
    assert live.add([0, 0, 0, 1, 1, 1], group=4, static=True).tolist() == [0]
    assert live.add(numpy.array([5, 5, 6, 6], numpy.float32)).tolist() == [1]
    ids = live.add(numpy.zeros((3, 6)), owner=7)
    assert live.filter(0) == throng.Filter(group=4, static=True) and live.filter(int(ids[2])).owner == 7
    assert live.box(1).tolist() == [5, 5, 0, 6, 6, 0]
    live.move(1, [7, 7, 7, 8, 8, 8])
    live.move(ids[1], numpy.array([9.0] * 6))  # a NumPy integer
    assert live.box(1).tolist() == [7, 7, 7, 8, 8, 8] and live.box(int(ids[1])).tolist() == [9] * 6
    live.set_filters(1, world=3)
    live.set_filters([0, 1], mask=6)
    assert live.filter(1)[:4] == (0xFFFFFFFF, 6, -1, 3) and live.filter(0).mask == 6
    assert live.find_overlaps([7, 7, 7, 7, 7, 7]).tolist() == [[0, 1]]
    live.remove(1)
    live.remove([int(i) for i in ids])
    assert len(live) == 1 and live.is_alive(0)
    with pytest.raises(ValueError, match="found 1 boxes for 2 ids"):
        live.move([0, 1], [0, 0, 0, 1, 1, 1])


# --- int64, arrays of another library


def test_int64() -> None:
    boxes = some_worlds(1, 40)[0]
    wanted = throng.find_pairs(boxes, order="canonical")
    for dtype in ("int64", numpy.int64, numpy.dtype("int64")):
        kind: Any = dtype
        found = throng.find_pairs(boxes, order="canonical", dtype=kind)
        assert found.dtype == numpy.int64 and numpy.array_equal(found, wanted)
    live = throng.BroadPhase(dtype="int64")
    assert live.add(boxes).dtype == numpy.int64
    live.update()
    pairs, times = live.find_hits(boxes[:5], numpy.ones((5, 3)))
    for found in (live.begun, live.ended, live.pairs, live.pairs_of(3), live.find_overlaps(boxes), pairs):
        assert found.dtype == numpy.int64
    assert times.dtype == numpy.float64 and numpy.array_equal(live.pairs[:, :2], wanted)
    assert live.copy().pairs.dtype == numpy.int64
    assert throng.BroadPhaseQuery(dtype="int64").find_overlaps(live, boxes).dtype == numpy.int64
    assert throng.BroadPhase().add(boxes).dtype == numpy.uint32


def test_the_same_library() -> None:
    strict = pytest.importorskip("array_api_strict")
    plain = some_worlds(1, 40)[0]
    boxes, by = strict.asarray(plain), strict.asarray(numpy.ones((40, 3), numpy.float32))
    live, reference = throng.BroadPhase(result="same", dtype="int64"), throng.BroadPhase()
    assert type(live.pairs) is numpy.ndarray  # before any boxes
    reference.add(plain)
    reference.update()
    ids = live.add(boxes)
    live.update()
    pairs, times = live.find_hits(boxes, by)
    for found in (ids, live.begun, live.ended, live.pairs, live.pairs_of(3), live.find_overlaps(boxes), pairs):
        assert type(found) is type(boxes) and found.dtype == strict.int64
    assert type(times) is type(boxes) and times.dtype == strict.float64
    assert numpy.array_equal(numpy.asarray(live.pairs), reference.pairs)
    assert type(live.find_overlaps(plain)) is numpy.ndarray  # of the query's boxes
    query = throng.BroadPhaseQuery(result="same")
    assert type(query.find_overlaps(live, boxes)) is type(boxes)
    live.move_all(plain)
    assert type(live.pairs) is numpy.ndarray
    live.move(ids, boxes)
    assert type(live.pairs) is type(boxes) and type(live.copy().pairs) is type(boxes)
    worlds = strict.asarray(some_worlds(4, 15))
    found = throng.find_pairs(worlds, result="same", dtype="int64")
    assert type(found) is type(boxes) and rows(numpy.asarray(found)) == triples(some_worlds(4, 15))


# --- float64 where float32 is kept


@settings(max_examples=150, deadline=None)
@given(double_rows(most=12), double_rows(most=6))
def test_no_pair_of_float64_is_lost(boxes: Any, other: Any) -> None:
    live = throng.BroadPhase()
    live.add(boxes)
    live.update()
    assert set(brute_force(boxes)) <= set(rows(live.pairs[:, :2]))
    assert set(brute_force(other, boxes)) <= set(rows(live.find_overlaps(other)))
    for i, box in enumerate(boxes):
        kept = live.box(i)
        if (box[:3] <= box[3:]).all():
            assert (kept[:3] <= box[:3]).all() and (kept[3:] >= box[3:]).all()
            with numpy.errstate(over="ignore"):
                inner = numpy.nextafter(kept, numpy.array([numpy.inf] * 3 + [-numpy.inf] * 3, numpy.float32))
            assert ((inner[:3] > box[:3]) | (kept[:3] == box[:3])).all()  # the tightest
    before = live.pair_count
    live.move_all(boxes)
    live.update()
    assert live.pair_count == before


def first_time(box: Any, by: Any, target: Any) -> Fraction | None:
    """When a moving box first touches another one, in exact arithmetic."""
    enter, leave = Fraction(0), Fraction(1)
    for k in range(3):
        gap = Fraction(float(target[k])) - Fraction(float(box[3 + k]))
        end = Fraction(float(target[3 + k])) - Fraction(float(box[k]))
        way = Fraction(float(by[k]))
        if way == 0:
            if gap > 0 or end < 0:
                return None
            continue
        times = sorted([gap / way, end / way])
        enter, leave = max(enter, times[0]), min(leave, times[1])
    return enter if enter <= leave else None


def test_no_hit_of_float64_is_lost() -> None:
    random = numpy.random.default_rng(5)
    objects = some_worlds(1, 60)[0]
    live = throng.BroadPhase()
    live.add(objects)
    origin = random.uniform(-2, 12, (300, 3))
    # Rays that just reach a corner, in float64.
    by = objects[random.integers(0, 60, 300), :3].astype(float) - origin
    sweeps = numpy.concatenate([origin, origin], axis=1)
    pairs, times = live.find_hits(sweeps, by)
    found = dict(zip(rows(pairs), times[numpy.lexsort(pairs.T[::-1])]))
    reached = 0
    for i in range(300):
        for j in range(60):
            at = first_time(sweeps[i], by[i], objects[j])
            if at is not None:
                assert Fraction(float(found[i, j])) <= at + Fraction(1, 10**14)
                reached += 1
    assert 300 <= reached <= len(found) < reached * 1.3  # the rays graze corners
    nothing = live.find_hits(numpy.full((1, 6), EMPTY, float), numpy.full((1, 3), 0.1))
    assert len(nothing[0]) == 0  # inactive, and stays so when it is extended


# --- several threads


def test_threads_query_one_broad_phase() -> None:
    boxes = throng.scene("uniform", 4000)[0]
    live = throng.BroadPhase(threads=1)
    live.add(boxes)
    live.update()
    by = numpy.full((300, 3), 3, numpy.float32)
    parts = [boxes[300 * k : 300 * (k + 1)] for k in range(4)]
    wanted = [(live.find_overlaps(part), live.find_hits(part, by), live.pairs_of(k)) for k, part in enumerate(parts)]
    start, failures, answered = threading.Barrier(4), list[BaseException](), [0] * 4

    def run(k: int) -> None:
        try:
            start.wait()
            for _ in range(30):
                assert numpy.array_equal(live.find_overlaps(parts[k]), wanted[k][0])
                pairs, times = live.find_hits(parts[k], by)
                assert numpy.array_equal(pairs, wanted[k][1][0]) and numpy.array_equal(times, wanted[k][1][1])
                assert numpy.array_equal(live.pairs_of(k), wanted[k][2])
                assert live.box(k).tolist() == boxes[k].tolist() and len(live) == 4000
                answered[k] += 1
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures and answered == [30] * 4
    live.remove(numpy.arange(4000))
    assert len(live.find_overlaps(boxes)) == 0


def test_changes_during_a_query_are_refused() -> None:
    boxes = numpy.zeros((2000, 6), numpy.float32)
    boxes[:, 3:] = 1
    live = throng.BroadPhase(threads=1)
    live.add(boxes)
    live.update()
    many = numpy.zeros((20000, 6), numpy.float32)  # 4e7 overlaps
    thread = threading.Thread(target=lambda: live.find_overlaps(many))
    thread.start()
    refused = asked = 0
    while thread.is_alive():
        assert len(live.find_overlaps(boxes[:1])) == 2000
        asked += 1
        for change in (lambda: live.move(0, boxes[0]), live.update, lambda: live.pairs):
            try:
                change()
            except RuntimeError as error:
                assert "queried by another thread; change it between queries" in str(error)
                refused += 1
        time.sleep(0.001)
    thread.join()
    assert refused > 0 and asked > 0
    live.move(0, boxes[0])
    live.update()
    assert live.pair_count == 1999 * 1000


def exact_box(points: Any, radius: Any, position: Any, way: Any, q: Any) -> Any:
    """Lower and upper bounds of a moved hull, in fractions."""
    x, y, z, w = (Fraction(float(v)) for v in q)
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    lower, upper = [], []
    for k in range(3):
        ends = [sum(matrix[k][j] * Fraction(float(p[j])) for j in range(3)) for p in points]
        at = Fraction(float(position[k]))
        places = (at, at + Fraction(float(way[k])))
        lower.append(min(ends) - Fraction(float(radius)) + min(places))
        upper.append(max(ends) + Fraction(float(radius)) + max(places))
    return lower, upper


@pytest.mark.parametrize("far", [0.0, 1e3, 1e9])
def test_boxes_of_float64_bodies_contain_them(far: float) -> None:
    random = numpy.random.default_rng(3)
    n = 60
    position = random.normal(size=(n, 3)) * 5 + far
    way = random.normal(size=(n, 3))
    q = random.normal(size=(n, 4))
    q /= numpy.sqrt((q * q).sum(axis=1, keepdims=True))
    points = random.normal(size=(40, 3))
    corners = [[sx, sy, sz] for sx in (-1, 1) for sy in (-2, 2) for sz in (-0.5, 0.5)]
    shapes = [throng.box((1, 2, 0.5)), throng.convex(0, 40, 0.25), throng.convex(7, 5)]
    hulls: list[Any] = [(corners, 0), (points, 0.25), (points[7:12], 0)]
    which = numpy.arange(n) % 3
    boxes = throng.update_boxes(position, shapes, rotation=q, displacement=way, shape=which, points=points)
    assert boxes.dtype == numpy.float32
    step = numpy.spacing(numpy.abs(boxes).max())
    for i in range(n):
        lower, upper = exact_box(*hulls[which[i]], position[i], way[i], q[i])
        for k in range(3):
            assert Fraction(float(boxes[i, k])) <= lower[k] and upper[k] <= Fraction(float(boxes[i, 3 + k]))
            slack = Fraction(4e-6) + 2 * Fraction(float(step))
            assert lower[k] - Fraction(float(boxes[i, k])) < slack > Fraction(float(boxes[i, 3 + k])) - upper[k]
    one = throng.update_boxes(position, [throng.sphere(0.5)])
    for i in range(n):
        lower, upper = exact_box([[0, 0, 0]], 0.5, position[i], [0] * 3, [0, 0, 0, 1])
        for k in range(3):  # within two float32 steps
            low, high = one[i, k], one[i, 3 + k]
            assert Fraction(float(low)) <= lower[k] and upper[k] <= Fraction(float(high))
            slack = 2 * Fraction(float(numpy.spacing(max(abs(low), abs(high), numpy.float32(0.5)))))
            assert lower[k] - Fraction(float(low)) < slack > Fraction(float(high)) - upper[k]
    bad = position.copy()
    bad[4, 1], bad[5, 2] = numpy.nan, numpy.inf
    found = throng.update_boxes(bad, [throng.sphere(1), throng.box((1, 1, 1))], shape=which % 2)
    assert numpy.isnan(found[[4, 5]]).all() and numpy.isfinite(numpy.delete(found, [4, 5], axis=0)).all()
    plane = throng.update_boxes(position[:1], [throng.box((numpy.inf, 0, numpy.inf))])
    assert numpy.isinf(plane[0, [0, 2, 3, 5]]).all() and plane[0, 1] <= position[0, 1] <= plane[0, 4]
    huge = throng.update_boxes([[1e300, 0, 0.1]], [throng.sphere(1)])
    assert huge[0, 0] == numpy.finfo(numpy.float32).max and huge[0, 3] == numpy.inf
    empty = throng.update_boxes(position[:1], [throng.convex(0, 0)], points=points)
    assert (empty[0, :3] > empty[0, 3:]).any()
    with pytest.raises(ValueError, match=r"displacement: found float32 of shape \(3, 3\), wanted"):
        throng.update_boxes(position, [throng.sphere(1)], displacement=way[:3])
