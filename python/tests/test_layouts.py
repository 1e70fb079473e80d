"""Boxes in other layouts: accepted, or refused with an error that names the mistake."""

import threading
from typing import Any

import numpy
import pytest
from reference import brute_force

import throng


def some_boxes(n: int, seed: int = 1, far: float = 1000.0) -> Any:
    random = numpy.random.default_rng(seed)
    lower = (random.random((n, 3)) * 10 + far).astype(numpy.float32)
    return numpy.hstack([lower, lower + random.random((n, 3)).astype(numpy.float32) * 2])


@pytest.mark.parametrize("d", [3, 2])
@pytest.mark.parametrize("kind", [numpy.float32, numpy.float64])
def test_corners_with_separate_index(d: int, kind: type) -> None:
    boxes = some_boxes(200)[:, [*range(d), *range(3, 3 + d)]].astype(kind)
    corners = boxes.reshape(-1, 2, d)
    wanted = throng.find_pairs(boxes, order="canonical")
    assert len(wanted) > 20
    for given in (corners, numpy.asfortranarray(corners), numpy.repeat(corners, 2, axis=0)[::2]):
        assert numpy.array_equal(throng.find_pairs(given, order="canonical"), wanted)
        assert numpy.array_equal(throng.Finder(order="canonical").find(given), wanted)
        live = throng.BroadPhase()
        live.add(given)
        live.update()
        assert numpy.array_equal(live.pairs[:, :2], wanted)
    odd = corners.astype(numpy.float64)
    odd[7, 1, 1] += 1e-9
    if d == 3:
        with pytest.raises(ValueError, match=r"at \[7, 1, 1\]"):
            throng.save_boxes("/nowhere/boxes.npy", odd)
    assert len(throng.find_pairs(odd, round="exact")) >= len(wanted)


def test_worlds_of_boxes_name_the_reshape() -> None:
    """Where they are not taken as they are."""
    boxes = some_boxes(60).reshape(4, 15, 6)
    with pytest.raises(ValueError) as caught:
        throng.BroadPhase().add(boxes)
    text = str(caught.value)
    remedy = "boxes.reshape(-1, 6), world=numpy.repeat(numpy.arange(4), 15)"
    assert remedy in text
    found = eval(f"throng.find_pairs({remedy}, order='canonical')", {"throng": throng, "numpy": numpy, "boxes": boxes})
    wanted = [(15 * w + i, 15 * w + j) for w in range(4) for i, j in brute_force(boxes[w])]
    assert [tuple(pair) for pair in found.tolist()] == wanted


def refused(boxes: Any, **options: Any) -> str:
    with pytest.raises(ValueError, match="lower > upper") as caught:
        throng.find_pairs(boxes, **options)
    assert "inverted='inactive'" in str(caught.value)
    return str(caught.value)


def test_the_likely_mistake_is_named() -> None:
    boxes = some_boxes(300)
    lower, upper = boxes[:, :3], boxes[:, 3:]
    center, size = (lower + upper) / 2, upper - lower
    text = refused((center, size))
    assert "300 of 300" in text and "the first is box 0" in text and "boxes_from_center" in text
    here = some_boxes(300, far=-5.0)
    text = refused((here[:, 3:], here[:, :3]))
    assert "look swapped" in text and "size" not in text
    text = refused(boxes[:, [0, 3, 1, 4, 2, 5]])
    assert "xmin, xmax, ymin" in text
    text = refused(boxes, other=numpy.hstack([upper, lower]))
    assert "of the second set" in text
    doubles = numpy.hstack([upper, lower]).astype(numpy.float64)
    assert "the first is box 0" in refused(doubles, round="exact")


def test_empty_slots_are_allowed_by_option() -> None:
    boxes = some_boxes(100)
    boxes[17] = [1, 1, 1, 0, 0, 0]
    assert "1 of 100 boxes" in refused(boxes)
    wanted = brute_force(boxes)
    assert [tuple(p) for p in throng.find_pairs(boxes, order="canonical", inverted="inactive").tolist()] == wanted
    finder = throng.Finder(order="canonical")
    assert [tuple(p) for p in finder.find(boxes).tolist()] == wanted and finder.result.inactive == 1
    strict = throng.Finder(inverted="refuse")
    with pytest.raises(ValueError, match="the first is box 17"):
        strict.find(boxes)
    with pytest.raises(ValueError, match="the first is box 17"):
        strict.consume(boxes, lambda pairs: pytest.fail("pairs of boxes that are refused"))
    live = throng.BroadPhase()
    live.add(boxes)
    assert live.update().inactive == 1
    live = throng.BroadPhase(inverted="refuse")
    with pytest.raises(ValueError, match="the first is box 17"):
        live.add(boxes)
    assert len(live) == 0
    for options in ({"inverted": "maybe"}, {"inverted": None}):
        with pytest.raises((ValueError, TypeError), match="inverted: found .*'refuse', 'inactive'"):
            throng.find_pairs(boxes, **options)


def test_boxes_from_centers() -> None:
    random = numpy.random.default_rng(3)
    for d in (2, 3):
        center = random.normal(size=(500, d)) * 10.0 ** random.integers(-9, 9, (500, 1))
        size = random.random((500, d)) * 10.0 ** random.integers(-9, 9, (500, 1))
        boxes = throng.boxes_from_center(center, size)
        assert boxes.shape == (500, 2 * d) and boxes.dtype == numpy.float32
        # Each contains the exact box, and one float less does not; checked in exact fractions.
        from fractions import Fraction

        for c, s, box in zip(center.ravel(), size.ravel(), boxes.reshape(-1, 2, d).transpose(0, 2, 1).reshape(-1, 2)):
            lower, upper = Fraction(c) - Fraction(s) / 2, Fraction(c) + Fraction(s) / 2
            inner = numpy.nextafter(box, numpy.array([numpy.inf, -numpy.inf], numpy.float32))
            assert Fraction(float(box[0])) <= lower < Fraction(float(inner[0]))
            assert Fraction(float(inner[1])) < upper <= Fraction(float(box[1]))
    assert throng.boxes_from_center([[1, 2, 3]], 2).tolist() == [[0, 1, 2, 2, 3, 4]]
    assert throng.boxes_from_center([[0, 0]], [[numpy.inf, 2]]).tolist() == [[-numpy.inf, -1, numpy.inf, 1]]
    assert throng.boxes_from_center(numpy.zeros((0, 3)), 1).shape == (0, 6)
    bad: list[tuple[Any, Any, str]] = [
        ([[0, 0, 0]], -1, "size: 1 are negative, the first is at 0"),
        ([0, 0, 0], 1, "center: found shape"),
        ([[0, 0, 0]], [[1, 2]], "size: found shape"),
    ]
    for center, size, text in bad:
        with pytest.raises(ValueError, match=text):
            throng.boxes_from_center(center, size)
    with pytest.raises(TypeError, match="size: found"):
        throng.boxes_from_center([[0, 0, 0]], "2")


def test_boxes_from_intervals() -> None:
    boxes = some_boxes(50)
    vtk = boxes[:, [0, 3, 1, 4, 2, 5]]
    assert numpy.array_equal(throng.boxes_from_intervals(*vtk.T), boxes)
    assert numpy.array_equal(throng.boxes_from_intervals(*vtk.T[:4]), boxes[:, [0, 1, 3, 4]])
    rounded = throng.boxes_from_intervals([0.1], [0.1], [0], 1)
    assert float(rounded[0, 0]) < 0.1 < float(rounded[0, 2]) and rounded.shape == (1, 4)
    with pytest.raises(TypeError, match="zmax: found None"):
        throng.boxes_from_intervals([0], [1], [0], [1], [0])
    with pytest.raises(ValueError, match="bounds: found shapes"):
        throng.boxes_from_intervals([0, 1], [1, 2, 3], [0], [1])


def test_numbers_are_refused_as_given() -> None:
    anything: Any = throng  # a type checker refuses this, too
    cases: list[tuple[Any, Any, str]] = [
        (lambda: anything.sphere("2"), TypeError, "radius: found '2', wanted a number"),
        (lambda: anything.sphere(1e39), ValueError, r"radius: found 1e\+39"),
        (lambda: anything.sphere(float("nan")), ValueError, "radius: found nan"),
        (lambda: anything.sphere(1, center=(0, 0)), ValueError, "center: found"),
        (lambda: anything.sphere(1, center=(0, "0", 0)), TypeError, r"center\[1\]: found '0'"),
        (lambda: anything.box("123"), TypeError, "half_extents: found '123'"),
        (lambda: anything.box((1, 2)), ValueError, "half_extents: found"),
        (lambda: anything.capsule(None, 1), TypeError, "half_length: found None"),
        (lambda: anything.convex(-1, 2), ValueError, "first_point: found -1"),
        (lambda: anything.convex(0, 2.5), TypeError, "point_count: found 2.5"),
        (lambda: anything.find_pairs(some_boxes(3), margin=1e39), ValueError, r"margin: found 1e\+39"),
        (lambda: anything.find_pairs(some_boxes(3), margin="1"), TypeError, "margin: found '1'"),
        (lambda: anything.BroadPhase(margin=float("nan")), ValueError, "margin: found nan"),
        (lambda: anything.update_boxes(numpy.zeros((1, 3), numpy.float32), [throng.sphere(1)], margin=None), TypeError, "margin: found None"),
    ]
    for call, kind, text in cases:
        with pytest.raises(kind, match=text):
            call()
    plane = throng.box((numpy.inf, 0, numpy.inf))
    assert plane["half_extents"].tolist() == [numpy.inf, 0, numpy.inf]


def test_hits_of_two_dimensions() -> None:
    live = throng.BroadPhase()
    live.add(numpy.array([[5, 0, 6, 1], [0, 5, 1, 6]], numpy.float32))
    rays = numpy.array([[0.5, 0.5]] * 2, numpy.float32)
    by = numpy.array([[10, 0], [0, 10]], numpy.float32)
    for way in (by, by.astype(numpy.float64), numpy.hstack([by, numpy.zeros((2, 1), numpy.float32)])):
        pairs, times = live.find_hits((rays, rays), way)
        assert pairs.tolist() == [[0, 0], [1, 1]] and times.tolist() == [0.45, 0.45]
    with pytest.raises(ValueError, match=r"by: found .*wanted float32 or float64 of shape \(2, 2\) or \(2, 3\)"):
        live.find_hits((rays, rays), numpy.zeros((2, 4), numpy.float32))
    with pytest.raises(ValueError, match=r"by: .*wanted float32 or float64 of shape \(2, 3\)"):
        live.find_hits(some_boxes(2), by)
    with pytest.raises(ValueError, match="3.4e38"):
        live.find_hits((rays, rays), numpy.array([[numpy.inf, 0]] * 2, numpy.float32))


def test_four_threads_query_at_once() -> None:
    boxes = some_boxes(4000, far=0.0)
    live = throng.BroadPhase()
    live.add(boxes)
    live.update()
    queries = [some_boxes(300, seed, far=0.0) for seed in range(4)]
    by = numpy.full((300, 3), 3, numpy.float32)
    wanted = [(live.find_overlaps(boxes), live.find_hits(boxes, by)) for boxes in queries]
    start, failures, answered = threading.Barrier(4), [], [0] * 4

    def run_query(k: int) -> None:
        try:
            query = throng.BroadPhaseQuery(threads=1)
            start.wait()
            for _ in range(30):
                assert numpy.array_equal(query.find_overlaps(live, queries[k]), wanted[k][0])
                pairs, times = query.find_hits(live, queries[k], by)
                assert numpy.array_equal(pairs, wanted[k][1][0])
                assert numpy.array_equal(times, wanted[k][1][1])
                answered[k] += 1
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run_query, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures and answered == [30] * 4
    # Afterwards objects may change, and queries see it.
    live.remove(numpy.arange(4000))
    query = throng.BroadPhaseQuery()
    assert len(query.find_overlaps(live, queries[0])) == 0
    with pytest.raises(TypeError, match="objects: found a str, wanted a BroadPhase"):
        query.find_overlaps("live", queries[0])  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        __import__("copy").copy(query)
