"""BroadPhase against two double loops, before and after."""

from typing import Any

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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
        # An id that was given away anew may be in a pair that ended and in one that began.
        assert before - after <= ids_of(live.ended) and after - before <= ids_of(live.begun)
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
    live.set_filters(ids[::2], static=numpy.zeros(1500, bool))
    live.update()
    assert ids_of(live.pairs) == set(brute_force(boxes))
    live.move_all(boxes + numpy.float32(0.5))
    live.shift_origin((0, 0, 1000))
    assert live.find_overlaps(boxes[:10]).shape == (0, 2)
    assert ids_of(snapshot.pairs) == set(wanted)
    asked = snapshot.find_overlaps(boxes[:10])
    assert [tuple(pair) for pair in asked.tolist()] == brute_force(boxes[:10], boxes)
    live.remove(ids[5:9])
    assert len(live) == 2996 and live.is_alive(4) and not live.is_alive(5)


def test_wrong() -> None:
    live = throng.BroadPhase()
    boxes = numpy.zeros((3, 6), numpy.float32)
    ids = live.add(boxes)
    live.update()

    def refuses(kind: type[Exception], text: str, call: Any, *args: Any, **named: Any) -> None:
        with pytest.raises(kind, match=text):
            call(*args, **named)

    refuses(ValueError, "7", live.remove, numpy.array([0, 7]))
    refuses(ValueError, ".", live.remove, numpy.array([1, 1]))
    refuses(ValueError, "ids: the value at 0 does not fit", live.remove, numpy.array([-1]))
    refuses(TypeError, "ids: found float64", live.remove, numpy.array([0.0]))
    refuses(TypeError, "ids: found None", live.remove, None)
    refuses(ValueError, "ids: found", live.remove, numpy.zeros((1, 1), numpy.uint32))
    refuses(ValueError, "found 2 boxes for 3 ids", live.move, ids, boxes[:2])
    refuses(ValueError, "NaN", live.move, ids, boxes * numpy.nan)
    refuses(TypeError, "boxes: found a list", live.add, [1])
    refuses(ValueError, "group: found", live.add, boxes, group=numpy.array([1]))
    refuses(ValueError, "margin", throng.BroadPhase, margin=-1)
    refuses(ValueError, "nan", throng.BroadPhase, nan="ok")
    assert len(live) == 3 and len(live.pairs) == 3


def test_ids_that_are_strided() -> None:
    live = throng.BroadPhase()
    ids = live.add(numpy.zeros((9, 6), numpy.float32))
    live.remove(ids[::-3])
    assert [live.is_alive(i) for i in range(9)] == [i % 3 != 2 for i in range(9)]
