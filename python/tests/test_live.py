"""BroadPhase against two double loops, before and after."""

import copy
import os
import pickle
import time
from typing import Any

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interrupt import MAX_SECONDS, ctrl_c
from reference import brute_force, coordinate

import throng

NOTHING = [1, 1, 1, 0, 0, 0]
box = st.lists(coordinate, min_size=6, max_size=6)
step = st.lists(
    st.tuples(st.sampled_from(["add", "move", "remove"]), st.integers(0, 30), box), max_size=8
)


def ids_of(pairs: Any) -> set[tuple[int, int]]:
    assert pairs.dtype == numpy.uint32 and pairs.ndim == 2 and pairs.shape[1] == 3
    found = [(int(i), int(j)) for i, j, _ in pairs]
    assert found == sorted(set(found))
    return set(found)


@settings(max_examples=300, deadline=None)
@given(st.lists(step, max_size=6))
def test_as_two_double_loops(steps: Any) -> None:
    live = throng.BroadPhase()
    model: dict[int, Any] = {}
    before: set[tuple[int, int]] = set()
    slots: dict[tuple[int, int], int] = {}
    for changes in steps:
        for kind, which, corners in changes:
            boxes = numpy.array([corners], numpy.float32)
            if kind == "add":
                model[int(live.add(boxes)[0])] = boxes[0]
                continue
            one = numpy.array([sorted(model)[which % len(model)] if model else which])
            if not model:
                with pytest.raises(ValueError):
                    live.remove(one)
            elif kind == "move":
                live.move(one, boxes)
                model[int(one[0])] = boxes[0]
            else:
                live.remove(one)
                del model[int(one[0])]
        result = live.update()
        everything = numpy.array([NOTHING] * live.id_limit, numpy.float32).reshape(-1, 6)
        for i, corners in model.items():
            everything[i] = corners
        after = set(brute_force(everything))
        assert ids_of(live.pairs) == after and result.found == live.pair_count == len(after)
        # A removed id is reused only after this update has reported its ended pairs.
        assert ids_of(live.ended) == before - after and ids_of(live.begun) == after - before
        for i, j, slot in live.begun:
            slots[int(i), int(j)] = int(slot)
        assert all(slots[int(i), int(j)] == slot for i, j, slot in live.pairs)
        assert len(set(live.pairs[:, 2].tolist())) == len(live.pairs)
        assert len(live) == len(model)
        before = after


def test_calls() -> None:
    boxes = throng.scene("uniform", 3000)[0]
    live = throng.BroadPhase(threads=2)
    ids = live.add(boxes, static=numpy.arange(3000) % 2 == 0)
    assert ids.tolist() == list(range(3000))
    live.update()
    snapshot = live.copy()
    both = numpy.arange(3000) % 2 == 0
    wanted = [(i, j) for i, j in brute_force(boxes) if not (both[i] and both[j])]
    assert ids_of(live.pairs) == set(wanted)
    for one in range(0, 3001, 50):
        of_one = [pair for pair in live.pairs.tolist() if one in pair[:2]]
        assert live.pairs_of(one).tolist() == of_one and live.pairs_of(one).shape == (len(of_one), 3)
    live.set_filters(ids[::2], static=numpy.zeros(1500, bool))
    live.update()
    assert ids_of(live.pairs) == set(brute_force(boxes))
    live.move_all(boxes + numpy.float32(0.5))
    live.shift_origin((0, 0, 1000))
    assert live.find_overlaps(boxes[:10]).shape == (0, 2)
    assert ids_of(snapshot.pairs) == set(wanted)
    overlaps = snapshot.find_overlaps(boxes[:10])
    assert [tuple(pair) for pair in overlaps.tolist()] == brute_force(boxes[:10], boxes)
    live.remove(ids[5:9])
    assert len(live) == 2996 and live.is_alive(4) and not live.is_alive(5)


@pytest.mark.parametrize(
    "by, kind",
    [
        ((1,), ValueError),
        ((1, 2, 3, 4), ValueError),
        (5, TypeError),
        (["x"] * 3, TypeError),
        ("123", TypeError),
        (("1", 2, 3), TypeError),
        ((1, 2, float("nan")), ValueError),
        ((1, 1e39, 2), ValueError),
        ((1, float("inf"), 2), ValueError),
    ],
)
def test_a_shift_is_three_numbers(by: Any, kind: type[Exception]) -> None:
    with pytest.raises(kind, match=r"^by(\[\d\])?: found .*, wanted (3 or 2 numbers|a number from)"):
        throng.BroadPhase().shift_origin(by)


def test_a_shift_of_two_dimensions() -> None:
    live = throng.BroadPhase()
    live.add(numpy.array([[0, 0, 1, 1]], numpy.float32))
    live.shift_origin((5, -2))
    assert live.box(0).tolist() == [5, -2, 0, 6, -1, 0]


def touch_times(boxes: Any, by: Any, objects: Any) -> Any:
    """(n, m) float64: the time when a sweep first touches an object; infinity: never."""
    a, b, way = (x.astype(numpy.float64) for x in (boxes, objects, by))
    with numpy.errstate(divide="ignore", invalid="ignore"):
        first = (b[None, :, :3] - a[:, None, 3:]) / way[:, None, :]
        last = (b[None, :, 3:] - a[:, None, :3]) / way[:, None, :]
    first, last = numpy.where(way[:, None, :] < 0, (last, first), (first, last))
    still = (way == 0)[:, None, :]
    meet = (b[None, :, :3] <= a[:, None, 3:]) & (a[:, None, :3] <= b[None, :, 3:])
    first = numpy.where(still, numpy.where(meet, 0.0, numpy.inf), first)
    last = numpy.where(still, 1.0, last)
    enter = numpy.maximum(first.max(axis=2), 0)
    return numpy.where(enter <= numpy.minimum(last.min(axis=2), 1), enter, numpy.inf)


@pytest.mark.parametrize("size, reach", [(0.0, 40.0), (0.5, 5.0), (0.0, 0.0)])
def test_find_hits(size: float, reach: float) -> None:
    random = numpy.random.default_rng(7)
    objects = throng.scene("uniform", 2000)[0]
    live = throng.BroadPhase()
    live.add(objects)
    low, high = objects[:, :3].min(), objects[:, 3:].max()
    origin = random.uniform(low, high, (300, 3)).astype(numpy.float32)
    by = random.uniform(-reach, reach, (300, 3)).astype(numpy.float32)
    by[::7, 1] = 0
    sweeps = origin, origin + numpy.float32(size)
    wanted = touch_times(numpy.concatenate(sweeps, axis=1), by, objects)
    pairs, times = live.find_hits(sweeps, by)
    assert numpy.array_equal(pairs, numpy.argwhere(numpy.isfinite(wanted)))
    assert numpy.array_equal(times, wanted[numpy.isfinite(wanted)])
    assert len(pairs) > 20
    pairs, times = live.find_hits(sweeps, by, which="first")
    met = numpy.flatnonzero(numpy.isfinite(wanted.min(axis=1)))
    assert numpy.array_equal(pairs, numpy.stack([met, wanted.argmin(axis=1)[met]], axis=1))
    assert numpy.array_equal(times, wanted.min(axis=1)[met])
    nobody, none = live.find_hits(sweeps, by, mask=numpy.zeros(300, numpy.uint32))
    assert nobody.shape == (0, 2) and none.shape == (0,)


def hit_by_loop(origin: Any, direction: Any, boxes: Any, most: float = numpy.inf) -> Any:
    """The closest box of a ray, and its distance, as the reference defines them; or None."""
    o, d, b = origin.astype(float), direction.astype(float), boxes.astype(float)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        lower, upper = (b[:, :3] - o) / d, (b[:, 3:] - o) / d
    first, last = numpy.where(d < 0, (upper, lower), (lower, upper))
    inside = (b[:, :3] <= o) & (o <= b[:, 3:])
    first = numpy.where(d == 0, numpy.where(inside, 0.0, numpy.inf), first)
    last = numpy.where(d == 0, numpy.inf, last)
    enter = numpy.maximum(first.max(axis=1), 0)
    distance = enter * numpy.sqrt((d * d).sum())
    enter[~(enter <= last.min(axis=1)) | (distance > most)] = numpy.inf
    closest = enter.argmin()
    return (closest, distance[closest]) if numpy.isfinite(enter[closest]) else None


def test_raycast() -> None:
    random = numpy.random.default_rng(3)
    objects = throng.scene("uniform", 2000)[0]
    live = throng.BroadPhase()
    group = numpy.where(numpy.arange(2000) % 2 == 0, 1, 4).astype(numpy.uint32)
    world = numpy.where(numpy.arange(2000) % 3 == 0, 5, 6).astype(numpy.int32)
    live.add(objects, group=group, world=world)
    low, high = objects[:, :3].min(), objects[:, 3:].max()
    hits = 0
    for k in range(400):
        origin = random.uniform(low, high, 3).astype(numpy.float32)
        direction = random.uniform(-1, 1, 3).astype(numpy.float32)
        if k % 5 == 0:
            direction[k % 3] = 0
        most = 4.0 if k % 3 == 0 else numpy.inf
        hit = live.raycast(origin, direction, most)
        wanted = hit_by_loop(origin, direction, objects, most)
        assert (hit and (hit.object, hit.distance)) == wanted
        hit = live.raycast(origin.tolist(), tuple(direction), most, layer_mask=6, world=5)
        chosen = numpy.flatnonzero((group == 4) & (world == 5))
        wanted = hit_by_loop(origin, direction, objects[chosen], most)
        assert (hit and (hit.object, hit.distance)) == (wanted and (chosen[wanted[0]], wanted[1]))
        hits += hit is not None
    assert hits > 20


def test_raycast_rules() -> None:
    live = throng.BroadPhase()
    assert live.raycast((0, 0, 0), (1, 0, 0)) is None
    live.add(numpy.array([[2, -1, -1, 4, 1, 1]], numpy.float32))
    hit = live.raycast((0, 0.5, 0), (10, 0, 0))
    assert hit == throng.RayHit(object=0, distance=2.0, point=(2.0, 0.5, 0.0), normal=(-1.0, 0.0, 0.0))
    assert live.raycast((0, 0.5), (0.25, 0), 2) == hit
    assert live.raycast((0, 0.5, 0), (1, 0, 0), 1.5) is None
    assert live.raycast((3, 0, 0), (0, -2, 0)) == (0, 0.0, (3.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for kind, text, arguments in [
        (ValueError, r"direction: found \(0, 0, 0\), wanted a vector other than 0", ((0, 0, 0), (0, 0, 0))),
        (ValueError, "max_distance: found -1, wanted 0 or more", ((0, 0, 0), (1, 0, 0), -1)),
        (ValueError, "max_distance: found nan", ((0, 0, 0), (1, 0, 0), numpy.nan)),
        (ValueError, r"origin\[0\]: found nan", ((numpy.nan, 0, 0), (1, 0, 0))),
        (ValueError, r"direction\[1\]: found inf", ((0, 0, 0), (1, numpy.inf, 0))),
        (ValueError, "origin: found", ((0,), (1, 0, 0))),
        (TypeError, "direction: found 1, wanted 3 or 2 numbers", ((0, 0, 0), 1)),
    ]:
        with pytest.raises(kind, match=text):
            live.raycast(*arguments)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="layer_mask: found -1"):
        live.raycast((0, 0, 0), (1, 0, 0), layer_mask=-1)
    with pytest.raises(ValueError, match="world: found 2147483648, wanted at most"):
        live.raycast((0, 0, 0), (1, 0, 0), world=2**31)


def test_a_copy_keeps_its_options() -> None:
    live = throng.BroadPhase(nan="inactive", margin=0.5)
    live.add(numpy.array([[0, 0, 0, 1, 1, 1], [2, 0, 0, 3, 1, 1]], numpy.float32))
    copy = live.copy()
    copy.add(numpy.full((1, 6), numpy.nan, numpy.float32))
    copy.update()
    assert ids_of(copy.pairs) == {(0, 1)} and len(live) == 2


@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize("query", [False, True])
def test_ctrl_c(query: bool) -> None:
    # All boxes overlap, and the filters exclude all pairs.
    live = throng.BroadPhase()
    everywhere = numpy.zeros((40000, 6), numpy.float32)
    everywhere[:, 3:] = 1
    live.add(everywhere, static=numpy.ones(40000, bool))
    live.update()
    many = numpy.broadcast_to(everywhere[0], (1500000, 6))
    by = numpy.broadcast_to(numpy.ones(3, numpy.float32), (1500000, 3))
    with ctrl_c():
        deadline = time.monotonic() + MAX_SECONDS
        while time.monotonic() < deadline:
            if query:
                live.find_hits(many, by, static=numpy.ones(1500000, bool))
            else:
                live.move(numpy.arange(40000), everywhere)
                live.update()
    assert len(live) == 40000 and live.update().found == 0


def test_wrong() -> None:
    live = throng.BroadPhase()
    boxes = numpy.zeros((3, 6), numpy.float32)
    ids = live.add(boxes)
    live.update()

    def refuses(kind: type[Exception], text: str, call: Any, *args: Any, **named: Any) -> None:
        with pytest.raises(kind, match=text):
            call(*args, **named)

    refuses(ValueError, "7", live.remove, numpy.array([0, 7]))
    refuses(ValueError, "the first is id 1 at index 1 of the list: it occurs twice", live.remove, numpy.array([1, 1]))
    refuses(ValueError, "ids: the value at 0 is -1, wanted 0 to 4294967295", live.remove, numpy.array([-1]))
    refuses(TypeError, "ids: found float64", live.remove, numpy.array([0.0]))
    refuses(TypeError, "ids: found None", live.remove, None)
    refuses(ValueError, "ids: found", live.remove, numpy.zeros((1, 1), numpy.uint32))
    refuses(ValueError, "found 2 boxes for 3 ids", live.move, ids, boxes[:2])
    refuses(ValueError, "NaN", live.move, ids, boxes * numpy.nan)
    refuses(ValueError, "boxes: found float64 of shape", live.add, [1])
    refuses(ValueError, "group: found", live.add, boxes, group=numpy.array([1]))
    by = numpy.zeros((3, 3), numpy.float32)
    refuses(TypeError, "by: found None", live.find_hits, boxes, None)
    refuses(TypeError, "by: found int64", live.find_hits, boxes, by.astype(int))
    huge = by + numpy.array([0, 1e39, 0])
    refuses(ValueError, r"by: the value at \[0, 1\] is 9.99\d*e\+38, wanted at most 3.4e38", live.find_hits, boxes, huge)
    refuses(ValueError, "ids: found 7.5|id 7", live.remove, 7)
    refuses(TypeError, "ids: found 7.5", live.remove, 7.5)
    refuses(ValueError, "ids: found -1, wanted 0 to 4294967295", live.remove, -1)
    refuses(TypeError, "ids: found '7'", live.remove, "7")
    refuses(ValueError, "result: found 'torch'", throng.BroadPhase, result="torch")
    refuses(ValueError, "dtype: found 'u4x'", throng.BroadPhase, dtype="u4x")
    for call in (live.box, live.filter):
        refuses(ValueError, r"id: found 7, wanted that of an object", call, 7)
        refuses(ValueError, "id: found -1", call, -1)
        refuses(TypeError, "id: found None", call, None)
    refuses(ValueError, r"by: found .* wanted float32 or float64 of shape \(3, 3\)", live.find_hits, boxes, by[:2])
    refuses(ValueError, "first is sweep 0", live.find_hits, boxes, by + numpy.float32(numpy.inf))
    refuses(ValueError, "which: found 'any'", live.find_hits, boxes, by, which="any")
    refuses(TypeError, "id: found", live.pairs_of, None)
    refuses(ValueError, "id: found -1", live.pairs_of, -1)
    refuses(ValueError, "margin", throng.BroadPhase, margin=-1)
    refuses(ValueError, "nan", throng.BroadPhase, nan="ok")
    assert len(live) == 3 and len(live.pairs) == 3


def test_box_and_filter() -> None:
    live = throng.BroadPhase()
    boxes = throng.scene("uniform", 10)[0]
    ids = live.add(boxes, owner=numpy.arange(10), static=numpy.arange(10) % 2 == 0)
    for i in ids:
        found = live.box(i)
        assert found.dtype == numpy.float32 and found.tolist() == boxes[i].tolist()
        assert live.filter(int(i)) == (0xFFFFFFFF, 0xFFFFFFFF, i, -1, i % 2 == 0)
    one = {"group": 5, "mask": 6, "owner": -1, "world": 8, "static": True}
    live.set_filters(ids[3:4], **{name: numpy.array([value]) for name, value in one.items()})
    assert live.filter(3)._asdict() == one and isinstance(live.filter(3), throng.Filter)
    live.move(ids[3:4], boxes[:1])
    assert live.box(3).tolist() == boxes[0].tolist()  # the current box, with or without an update
    live.remove(ids[3:4])
    with pytest.raises(ValueError, match="id: found 3"):
        live.box(3)
    live.add(boxes[:1])
    assert live.filter(10) == throng.Filter()


class Named(throng.BroadPhase):
    name: list[str]


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, throng.BroadPhase.copy])
def test_copies_are_snapshots(way: Any) -> None:
    live = Named()
    live.name = ["mine"]
    ids = live.add(numpy.zeros((3, 6), numpy.float32))
    live.update()
    made = way(live)
    live.remove(ids[:1])
    live.update()
    assert (len(live), live.pair_count, len(made), made.pair_count) == (2, 1, 3, 3)
    made.remove(ids)
    assert len(live) == 2
    assert type(made) is Named and made.name == ["mine"]
    assert (made.name is live.name) == (way is not copy.deepcopy)
    both = copy.deepcopy([live, live])
    assert both[0] is both[1] and both[0] is not live
    with pytest.raises(TypeError, match="BroadPhase is not pickled: .*add that to a new one"):
        pickle.dumps(live)


def test_hits_of_float64() -> None:
    live = throng.BroadPhase()
    live.add(throng.scene("uniform", 100)[0])
    origin = numpy.zeros((5, 3))
    by = numpy.arange(15.0).reshape(3, 5).T[::-1]  # column order, negative stride
    pairs, times = live.find_hits((origin, origin), by)
    single = origin.astype(numpy.float32)
    wanted = live.find_hits((single, single), numpy.ascontiguousarray(by, numpy.float32))
    assert numpy.array_equal(pairs, wanted[0]) and numpy.array_equal(times, wanted[1])


def test_ids_that_are_strided() -> None:
    live = throng.BroadPhase()
    ids = live.add(numpy.zeros((9, 6), numpy.float32))
    live.remove(ids[::-3])
    assert [live.is_alive(i) for i in range(9)] == [i % 3 != 2 for i in range(9)]
