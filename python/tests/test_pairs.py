"""The pairs are those of the double loop."""

from typing import Any

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import NAN, any_coordinate, as_pairs, box_rows, brute_force, find_pairs, overlap, pairs_of

import throng

choices = st.fixed_dictionaries(
    {
        "order": st.sampled_from(["any", "canonical"]),
        "algorithm": st.sampled_from(["auto", "all-pairs", "grid"]),
        "threads": st.integers(0, 3),
        "backend": st.sampled_from(["auto", "cpu", "emulated"]),
    }
)


@settings(max_examples=300, deadline=None)
@given(box_rows(), choices)
def test_one_set(boxes: Any, options: Any) -> None:
    found = find_pairs(boxes, **options)
    assert as_pairs(found) == brute_force(boxes)
    if options["order"] == "canonical":
        assert as_pairs(found) == [tuple(pair) for pair in found.tolist()]


@settings(max_examples=200, deadline=None)
@given(box_rows(most=12), box_rows(most=12), choices)
def test_two_sets(a: Any, b: Any, options: Any) -> None:
    assert as_pairs(find_pairs(a, b, **options)) == brute_force(a, b)


@settings(max_examples=200, deadline=None)
@given(box_rows(columns=4))
def test_flat(boxes: Any) -> None:
    assert as_pairs(find_pairs(boxes)) == brute_force(boxes)
    assert as_pairs(find_pairs((boxes[:, :2], boxes[:, 2:]))) == brute_force(boxes)


@settings(max_examples=300, deadline=None)
@given(box_rows(value=any_coordinate))
def test_nan(boxes: Any) -> None:
    bad = numpy.isnan(boxes).any(axis=1)
    # A box with a NaN overlaps nothing, even if no comparison involves the NaN.
    assert as_pairs(find_pairs(boxes, nan="inactive")) == brute_force(
        numpy.where(bad[:, None], numpy.float32(NAN), boxes)
    )
    if bad.any():
        with pytest.raises(ValueError, match=f"the first is box {int(bad.argmax())}"):
            find_pairs(boxes)
    else:
        assert as_pairs(find_pairs(boxes)) == brute_force(boxes)


def integers(type_: type, low: int, high: int) -> Any:
    return st.lists(st.integers(low, high), min_size=16, max_size=16).map(
        lambda values: numpy.array(values, type_)
    )


@settings(max_examples=200, deadline=None)
@given(
    st.integers(1, 16),
    integers(numpy.uint32, 0, 7),
    integers(numpy.int64, 0, 7),
    integers(numpy.int32, -1, 2),
    integers(numpy.int8, -1, 2),
    integers(numpy.bool_, 0, 1),
    st.lists(st.booleans(), min_size=5, max_size=5),
)
def test_filters(n: int, group: Any, mask: Any, owner: Any, world: Any, static: Any, on: Any) -> None:
    boxes = numpy.zeros((n, 6), numpy.float32)
    given_ = {"group": group, "mask": mask, "owner": owner, "world": world, "static": static}
    filters = {k: v[:n] for (k, v), is_on in zip(given_.items(), on) if is_on}
    wanted = numpy.ones((n, n), bool)
    g = filters.get("group", numpy.full(n, 0xFFFFFFFF, numpy.int64)).astype(numpy.int64)
    m = filters.get("mask", numpy.full(n, 0xFFFFFFFF, numpy.int64)).astype(numpy.int64)
    meets = (g[:, None] & m[None, :]) != 0
    wanted &= meets & meets.T
    if "owner" in filters:
        o = filters["owner"]
        wanted &= (o[:, None] != o[None, :]) | (o[:, None] == -1)
    if "world" in filters:
        w = filters["world"]
        wanted &= (w[:, None] == w[None, :]) | (w[:, None] == -1) | (w[None, :] == -1)
    if "static" in filters:
        wanted &= ~(filters["static"][:, None] & filters["static"][None, :])
    assert as_pairs(find_pairs(boxes, **filters)) == pairs_of(wanted, True)
    other = {"other_" + k: v for k, v in filters.items()}
    both = find_pairs(boxes, boxes, **filters, **other)
    assert as_pairs(both) == pairs_of(wanted, False)


@pytest.mark.parametrize("name", throng.scene_names)
def test_scenes(name: str) -> None:
    boxes = throng.scene(name, 900)[0]
    assert as_pairs(find_pairs(boxes)) == brute_force(boxes)


def test_large_and_threads() -> None:
    boxes = throng.scene("pile", 60000)[0]
    wanted = find_pairs(boxes, order="canonical", algorithm="all-pairs")
    for threads in (0, 1, 2, 5):
        found = find_pairs(boxes, order="canonical", threads=threads)
        assert numpy.array_equal(found, wanted)


def test_more_pairs_than_capacity() -> None:
    boxes = numpy.zeros((1000, 6), numpy.float32)
    found = find_pairs(boxes, order="canonical")
    assert numpy.array_equal(found, numpy.argwhere(numpy.triu(overlap(boxes, boxes), 1)))


def test_margin_is_rounded_up() -> None:
    boxes = numpy.array([[0, 0, 0, 1, 1, 1], [1.2, 0, 0, 2, 1, 1]], numpy.float32)
    assert len(find_pairs(boxes, margin=0.05)) == 0
    assert len(find_pairs(boxes, margin=0.1000001)) == 1
    assert len(find_pairs(boxes, margin=1)) == 1
    apart = numpy.array([[0, 0, 0, 0, 0, 0], [2, 0, 0, 2, 0, 0]], numpy.float32)
    assert len(find_pairs(apart, margin=1 - 1e-12)) == 1  # not a float32: rounds to 1, not below


def test_empty() -> None:
    none = numpy.zeros((0, 6), numpy.float32)
    one = numpy.zeros((1, 6), numpy.float32)
    for found in (
        find_pairs(none),
        find_pairs(one),
        find_pairs(none, one),
        find_pairs(one, none, group=numpy.array([1])),
    ):
        assert found.shape == (0, 2) and found.dtype == numpy.uint32


def test_the_result_is_its_own() -> None:
    boxes = numpy.zeros((50, 6), numpy.float32)
    found = find_pairs(boxes)
    copy = found.copy()
    second_result = find_pairs(boxes)
    second_result[:] = 7
    assert numpy.array_equal(found, copy) and found.flags.writeable
