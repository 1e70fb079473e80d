"""Finder: frames, blocks, threads, Ctrl-C, and results."""

import copy
import os
import pickle
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy
import pytest
from interrupt import ctrl_c
from reference import as_pairs, brute_force

import throng


def test_frames_and_memory() -> None:
    frames = throng.scene("column", 3000, frames=6, seed=3)
    finder = throng.Finder(order="canonical")
    kept = []
    for boxes in frames:
        found = finder.find(boxes)
        assert as_pairs(found) == brute_force(boxes)
        kept.append((found, found.copy()))
    for found, copy in kept:  # later calls do not change earlier results
        assert numpy.array_equal(found, copy)
    finder.find(frames[0])
    held = finder.memory_bytes
    for _ in range(5):
        finder.find(frames[0])
    assert finder.memory_bytes == held > 0


def test_result() -> None:
    boxes = throng.scene("uniform", 20000)[0].copy()
    boxes[7] = [1, 1, 1, 0, 0, 0]
    finder = throng.Finder()
    assert finder.result.found == 0
    found = finder.find(boxes)
    result = finder.result
    assert result.status == "ok"
    assert result.found == result.written == len(found)
    assert result.inactive == 1
    assert result.comparisons >= result.found
    assert result.visited >= len(boxes) - 1 and "visited=" in repr(result)
    assert result.plan.algorithm == "grid" and result.plan.backend == "cpu"
    assert result.plan.threads >= 1 and len(result.plan.columns) == 3
    assert len(result.plan.reason) > 10 and result.plan.isa in repr(result.plan)
    times = result.times
    assert 0 < times.find_ms <= times.total_ms and times.order_ms == 0
    assert "found=" in repr(result) and "total_ms=" in repr(times)
    finder.find(boxes[:2])
    assert result.found == len(found)  # the next call does not change a result


def test_explain() -> None:
    boxes = throng.scene("mixed", 20000)[0].copy()
    boxes[77, :3] -= 50
    finder = throng.Finder()
    explanation = finder.explain(boxes)
    assert explanation.result.found == len(throng.find_pairs(boxes)) == finder.result.found
    assert explanation.boxes == 20000 and explanation.cells == explanation.occupancy.size == explanation.occupancy.shape[0] * (
        explanation.occupancy.shape[1] * explanation.occupancy.shape[2]
    )
    assert explanation.occupancy.shape == explanation.result.plan.columns
    assert explanation.entries == explanation.occupancy.sum() and explanation.occupied == (explanation.occupancy > 0).sum()
    assert explanation.densest[0].boxes == explanation.occupancy.max()
    lower, upper = explanation.densest[0].bounds[:3], explanation.densest[0].bounds[3:]
    assert all(g <= d for g, d in zip(explanation.grid[:3], lower)) and lower < upper
    extents = (boxes[:, 3:] - boxes[:, :3]).max(axis=1)
    assert explanation.largest[0].index == extents.argmax() and not explanation.largest[0].in_second_set
    assert [b.extent for b in explanation.largest] == sorted(extents.tolist())[:-11:-1]
    assert sum(c.boxes for c in explanation.size_classes) == 20000
    for c in explanation.size_classes:
        assert c.boxes == ((extents >= c.least) & (extents < c.below)).sum() and c.cells_per_box >= 1
    assert sum(explanation.memory.values()) == explanation.memory_bytes > 0
    assert "boxes=20000" in repr(explanation) and all(len(advice) > 20 for advice in explanation.advice)
    assert sorted(c.algorithm for c in explanation.candidates) == ["all-pairs", "grid", "grid", "grid"]
    cheapest = explanation.candidates[0]
    assert cheapest.columns == tuple(explanation.result.plan.columns) and cheapest.expected_ns > 0
    few = finder.explain(boxes[:50], boxes[:9])
    assert few.cells == 0 and few.occupancy.shape == (0, 0, 0) and "59 boxes are few" in few.advice[0]
    with pytest.raises(ValueError, match="boxes: found"):
        finder.explain(boxes[:, :5])
    with pytest.raises(ValueError, match="explained on the CPU alone; set backend"):
        throng.Finder(backend="emulated").explain(boxes)


def test_exact() -> None:
    """float64 frames a billion units away, where float32 does not resolve them; float32 between them."""
    finder = throng.Finder(order="canonical", round="exact")
    frames = throng.scene("column", 1500, frames=4, seed=3)
    for floats in frames:
        boxes = floats.astype(numpy.float64) + 1e9
        boxes[1::2, :3] = boxes[::2, 3:]  # touch, and miss by one step
        boxes[1::4, 0] = numpy.nextafter(boxes[1::4, 0], numpy.inf)
        boxes[1::2, 3:] = boxes[1::2, :3] + 1
        wanted = brute_force(boxes)
        assert as_pairs(finder.find(boxes)) == wanted and finder.result.inactive == 0
        blocks: list[Any] = []
        assert finder.consume(boxes, blocks.append).found == len(wanted)
        assert as_pairs(numpy.concatenate(blocks)) == wanted
        assert as_pairs(finder.find(floats)) == brute_force(floats)
        far = boxes[:200].astype(numpy.float32)
        assert as_pairs(finder.find(far, boxes)) == brute_force(far, boxes)
        blocks.clear()
        assert finder.consume(boxes, blocks.append, far).found == len(brute_force(boxes, far))
    explained = finder.explain(boxes)  # as float32, rounded outward
    assert explained.result.found == len(throng.find_pairs(boxes, round="outward"))
    with pytest.raises(ValueError, match="the first is box 0"):
        finder.find(boxes * numpy.nan)
    with pytest.raises(ValueError, match="boxes of float64 are searched on the CPU alone; pass round='outward'"):
        throng.Finder(backend="emulated", round="exact").consume(boxes, print)


def test_second_set_and_growth() -> None:
    finder = throng.Finder(order="canonical")
    few = throng.scene("uniform", 500)[0]
    many = numpy.zeros((700, 6), numpy.float32)
    for a, b in ((few, few), (many, many), (few, many)):
        assert as_pairs(finder.find(a, b)) == brute_force(a, b)
        assert as_pairs(finder.find(b)) == brute_force(b)


@pytest.mark.parametrize("order", ["any", "canonical"])
@pytest.mark.parametrize("objects", [900, 50000])
def test_consume(order: Any, objects: int) -> None:
    boxes = throng.scene("pile", objects)[0]
    blocks: list[Any] = []
    finder = throng.Finder(order=order)
    result = finder.consume(boxes, blocks.append)
    together = numpy.concatenate(blocks)
    assert result.status == "ok" and result.found == len(together)
    wanted = throng.find_pairs(boxes, order="canonical")
    if order == "any":
        together = together[numpy.lexsort((together[:, 1], together[:, 0]))]
    assert numpy.array_equal(together, wanted)


def test_consume_stops_and_raises() -> None:
    boxes = numpy.zeros((1000, 6), numpy.float32)
    finder = throng.Finder()
    seen = []

    def stop(pairs: Any) -> bool:
        seen.append(len(pairs))
        return False

    result = finder.consume(boxes, stop)
    assert result.status == "stopped" and result.written == seen[0] and len(seen) == 1

    def fail(pairs: Any) -> None:
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        finder.consume(boxes, fail)
    with pytest.raises(RuntimeError, match="called by its own consumer"):
        finder.consume(boxes, lambda pairs: finder.find(boxes))
    with pytest.raises(TypeError, match="callback: found 3"):
        finder.consume(boxes, 3)  # type: ignore[arg-type]
    assert len(finder.find(boxes)) == 499500


@pytest.mark.parametrize("kind", [numpy.float32, numpy.float64])
def test_memory_cap(kind: Any) -> None:
    boxes = throng.scene("uniform", 30000)[0].astype(kind)
    with pytest.raises(MemoryError, match=r"raise memory_cap to \d+ or more") as caught:
        throng.Finder(memory_cap=1000, round="exact").consume(boxes, lambda pairs: None)
    enough = int(str(caught.value).split("memory_cap to ")[1].split()[0])
    finder = throng.Finder(memory_cap=enough, round="exact")
    assert finder.consume(boxes, lambda pairs: None).found == len(throng.find_pairs(boxes))
    assert finder.memory_bytes <= enough


def test_nan_keeps_the_finder_usable() -> None:
    boxes = throng.scene("uniform", 1000)[0].copy()
    finder = throng.Finder()
    wanted = finder.find(boxes)
    boxes[17, 2] = numpy.nan
    with pytest.raises(ValueError, match="the first is box 17; .* pass nan='inactive'"):
        finder.find(boxes)
    with pytest.raises(ValueError, match="of the second set"):
        finder.find(boxes[:5], boxes)
    boxes[17] = throng.scene("uniform", 1000)[0][17]
    assert as_pairs(finder.find(boxes)) == as_pairs(wanted)


class RaisesOnBool:
    def __bool__(self) -> bool:
        raise KeyError("mine, too")


@pytest.mark.parametrize("answer, stops", [
    (None, False), (True, False), (1, False), ("on", False), (numpy.bool_(True), False),
    (False, True), (0, True), (numpy.bool_(False), True), ([], True), (numpy.zeros(1), True),
])  # fmt: skip
@pytest.mark.parametrize("objects", [1000, 40000])
def test_what_a_consumer_returns(answer: Any, stops: bool, objects: int) -> None:
    boxes = throng.scene("pile", objects)[0]
    finder = throng.Finder()
    result = finder.consume(boxes, lambda pairs: answer)
    assert result.status == ("stopped" if stops else "ok")
    with pytest.raises(KeyError, match="mine, too"):
        finder.consume(boxes, lambda pairs: RaisesOnBool())
    with pytest.raises(ValueError, match="truth value"):
        finder.consume(boxes, lambda pairs: numpy.zeros(2))
    assert len(finder.find(boxes)) > 0


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, pickle.dumps])
def test_no_copies(way: Any) -> None:
    with pytest.raises(TypeError, match=r"Finder cannot be copied or pickled: make another, throng.Finder\("):
        way(throng.Finder())


def test_threads_at_once() -> None:
    boxes = throng.scene("pile", 50000)[0]
    wanted = len(throng.find_pairs(boxes))
    found: list[int] = []

    def search() -> None:
        for _ in range(5):
            found.append(len(throng.find_pairs(boxes)))

    threads = [threading.Thread(target=search) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [wanted] * 30


def test_one_thread_at_a_time_and_others_run() -> None:
    boxes = throng.scene("uniform", 60000)[0]
    finder = throng.Finder(algorithm="all-pairs")
    long = threading.Thread(target=finder.find, args=(boxes,))
    long.start()
    refused = turns = 0
    while long.is_alive():
        turns += 1  # this thread runs: the interpreter's lock is free
        try:
            throng.Finder.find(finder, boxes[:10])
        except RuntimeError as error:
            assert "another thread" in str(error)
            refused += 1
        time.sleep(0.001)
    assert turns > 3 and refused > 3


@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize("way", ["find", "consume", "emulated", "explain", "update_boxes", "exact"])
def test_ctrl_c(way: str) -> None:
    boxes: Any = throng.scene("sparse", 1500000)[0]
    backend: Any = "emulated" if way == "emulated" else "cpu"
    finder = throng.Finder(algorithm="all-pairs", backend=backend, round="exact" if way == "exact" else "outward")
    if way == "exact":
        boxes = boxes.astype(numpy.float64)
    position = numpy.broadcast_to(numpy.zeros(3, numpy.float32), (20000000, 3))
    with ctrl_c():  # the whole work takes minutes
        if way == "consume":
            finder.consume(boxes, lambda pairs: None)
        elif way == "explain":
            finder.explain(boxes)
        elif way == "update_boxes":
            # Hulls of many points: 2e11 in all.
            points = numpy.zeros((10000, 3), numpy.float32)
            throng.update_boxes(position, [throng.convex(0, 10000)], points=points)
        else:
            finder.find(boxes)
    few = throng.scene("uniform", 300)[0]
    assert as_pairs(finder.find(few)) == brute_force(few) != []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_fork() -> None:
    boxes = throng.scene("uniform", 100000)[0]
    wanted = len(throng.find_pairs(boxes))
    child = os.fork()
    if child == 0:
        os._exit(0 if len(throng.find_pairs(boxes)) == wanted else 3)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.parametrize("way", [
    "find_pairs", "float64", "long", "find", "consume", "consume, long", "update", "find_hits", "update_boxes", "scene",
])  # fmt: skip
def test_the_end_while_a_daemon_thread_searches(way: str) -> None:
    program = [sys.executable, str(Path(__file__).parent / "at_exit.py"), way]
    done = subprocess.run(program, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "True, callback: the interpreter is ending, and calls none; use find\n"
