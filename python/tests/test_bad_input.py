"""Any input is accepted, or refused by the conventional exception that names the argument, the value
and the fix; never a crash. THRONG_EXAMPLES sets the number of cases of each kind (100).
"""

import os
from typing import Any

import numpy
import pytest
from dlpack import CUDA, ArrayOnDevice, OnlyDLPack, capsule
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import as_strided
from reference import NAN, any_coordinate, as_pairs, box_rows, brute_force, double_rows, find_pairs

import throng
from throng import _throng

EXAMPLES = settings(max_examples=int(os.environ.get("THRONG_EXAMPLES", "100")), deadline=None)
BOXES = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [3, 3, 3, 4, 4, 4]], numpy.float32)

size = st.integers(0, 9)
step = st.integers(1, 3)
argument = st.sampled_from(["boxes", "other", "lower", "upper"])


def call(name: str, array: Any, **options: Any) -> Any:
    """`array` as the argument `name`, with valid other arguments."""
    if name == "boxes":
        return find_pairs(array, **options)
    if name == "other":
        return find_pairs(BOXES, array, **options)
    return find_pairs((array, BOXES[:, 3:]) if name == "lower" else (BOXES[:, :3], array), **options)


def refused(kinds: Any, name: str, text: str, array: Any, **options: Any) -> None:
    with pytest.raises(kinds, match=text) as caught:
        call(name, array, **options)
    assert str(caught.value).startswith("other" if name == "other" else "boxes")
    assert len(str(caught.value)) > 40


@EXAMPLES
@given(argument, st.sampled_from("? b B h H i I q Q e g F D G >f4 >f8 O S3 U2 M8[s] V4".split()), size)
def test_types(name: str, kind: str, n: int) -> None:
    columns = 3 if name in ("lower", "upper") else 6
    refused(TypeError, name, "found .*wanted", numpy.zeros((n, columns), kind))
    refused(TypeError, name, "found .*wanted", numpy.zeros((n, columns), kind), round="exact")


@EXAMPLES
@given(argument, st.sampled_from(["f4", "f8"]), st.lists(size, max_size=5))
def test_shapes(name: str, kind: str, shape: list[int]) -> None:
    array = numpy.zeros(shape, kind)
    fits = len(shape) == 2 and shape[1] in (4, 6)
    fits = fits or len(shape) == 3 and shape[1] == 2 and shape[2] in (2, 3)
    if len(shape) == 3 and shape[2] in (4, 6) or len(shape) == 4 and shape[2:] in ([2, 2], [2, 3]):
        return  # worlds: test_conveniences
    if len(shape) == 3 and name in ("lower", "upper"):
        return
    if name in ("lower", "upper"):
        # The shape fits; its rows are 12 bytes apart, those of the other corners 24.
        refused(ValueError, name, "found|apart", array)
        if shape == [3, 3] and kind == "f4":
            beside = numpy.zeros((3, 6), numpy.float32)[:, :3]
            both = (beside, BOXES[:, 3:]) if name == "lower" else (BOXES[:, :3], beside)
            assert as_pairs(call(name, beside)) == brute_force(numpy.concatenate(both, axis=1))
        return
    if not fits:
        refused(ValueError, name, r"found float\d\d of shape \(.*wanted", array)
        refused(ValueError, name, r"found float\d\d of shape \(.*wanted", array, round="outward")
        return
    for round in ("outward", "exact"):
        flat = array.reshape(shape[0], -1)
        if name == "boxes":
            assert as_pairs(call(name, array, round=round)) == brute_force(flat)
        elif flat.shape[1] == 4:
            refused(ValueError, name, "other: found 2-D boxes and 3-D", array, round=round)
        else:
            assert as_pairs(call(name, array, round=round)) == brute_force(BOXES, flat)


@EXAMPLES
@given(st.lists(st.sampled_from([None, (1, 0), (CUDA, 0), (CUDA, 1), (10, 0), (99, -1)]), min_size=4, max_size=4))
def test_devices(devices: list[Any]) -> None:
    def put(array: Any, device: Any) -> Any:
        if device is None or device == (1, 0):
            return array if device is None else OnlyDLPack(array)
        return ArrayOnDevice(device, array)

    world = numpy.zeros(3, numpy.int32)
    boxes, other = put(BOXES, devices[0]), put(BOXES, devices[1])
    filters = {"world": put(world, devices[2]), "other_world": put(world, devices[3])}
    places = {(1, 0) if device is None else device for device in devices}
    if places == {(1, 0)}:
        assert len(find_pairs(boxes, other, **filters)) == 7
        return
    kinds = (ValueError, RuntimeError) if _throng.has_cuda and len(places) == 1 else ValueError
    with pytest.raises(kinds, match="found an array on|no GPU|GPU failed|device memory"):
        find_pairs(boxes, other, **filters)


@EXAMPLES
@given(box_rows(most=8) | double_rows(most=8), step, step, size, st.booleans(), st.booleans())
def test_layouts(boxes: Any, row: int, column: int, first: int, frozen: bool, turned: bool) -> None:
    wide = numpy.full((len(boxes) * row + 1, first + 6 * column), NAN, boxes.dtype)
    part = wide[: len(boxes) * row : row, first : first + 6 * column : column]
    part[:] = boxes[:, ::-1] if turned else boxes
    wide.flags.writeable = not frozen
    given_ = part[:, ::-1] if turned else part
    assert as_pairs(find_pairs(given_, round="exact")) == brute_force(boxes)
    assert as_pairs(find_pairs((given_[:, :3], given_[:, 3:]), round="exact")) == brute_force(boxes)
    if boxes.dtype == numpy.float32:
        assert as_pairs(find_pairs(given_)) == brute_force(boxes)
        assert as_pairs(find_pairs((given_[:, :3], given_[:, 3:]))) == brute_force(boxes)


@EXAMPLES
@given(argument, st.sampled_from(["used", "another", "nowhere"]), size)
def test_capsules(name: str, what: str, n: int) -> None:
    columns = 3 if name in ("lower", "upper") else 6
    array = numpy.zeros((n, columns), numpy.float32)
    if what == "nowhere":  # on a device that does not exist: the address is never read
        refused(ValueError, name, "found an array on device type 7", capsule(array, 1, (7, 0)))
        return
    held: Any = array.__dlpack__()
    if what == "used":
        numpy.from_dlpack(ReusedCapsule(held))
    else:
        held = datetime_capsule()
    refused(TypeError, name, "found a PyCapsule", held)


class ReusedCapsule:
    def __init__(self, held: Any) -> None:
        self.held = held

    def __dlpack_device__(self) -> Any:
        return (1, 0)

    def __dlpack__(self, **_: Any) -> Any:
        return self.held


def datetime_capsule() -> Any:
    """A capsule of another type."""
    import datetime

    return getattr(datetime, "datetime_CAPI")


@EXAMPLES
@given(argument, st.integers(2**32, 2**57), st.sampled_from(["f4", "f8"]))
def test_huge(name: str, n: int, kind: str) -> None:
    one = numpy.zeros(6, kind)
    if name in ("lower", "upper"):
        refused(ValueError, name, "of one type and shape", as_strided(one, (n, 3), (0, one.itemsize)))
    else:
        refused(ValueError, name, f"found {n} boxes, at most 4294901760", as_strided(one, (n, 6), (0, one.itemsize)))


@EXAMPLES
@given(argument, st.integers(2, 9), step, st.sampled_from(["f4", "f8"]))
def test_backwards(name: str, n: int, by: int, kind: str) -> None:
    if name in ("lower", "upper"):
        n = 3
    array = numpy.zeros((n * by, 3 if name in ("lower", "upper") else 6), kind)[::-by]
    if kind == "f4":
        refused(ValueError, name, "run backwards|apart", array)
    elif name in ("lower", "upper"):
        refused(ValueError, name, "of one type", array)
    else:
        call(name, array)  # copied
        call(name, array, round="outward")


@pytest.mark.parametrize("name", ["boxes", "other", "lower", "upper"])
def test_masked(name: str) -> None:
    columns = {"lower": slice(0, 3), "upper": slice(3, 6)}.get(name, slice(0, 6))
    rows = BOXES[:, columns]
    assert len(call(name, numpy.ma.MaskedArray(rows))) == len(call(name, rows))
    hidden = numpy.ma.MaskedArray(rows, mask=numpy.zeros(rows.shape, bool))
    hidden[1] = numpy.ma.masked
    refused(ValueError, name, "masked array that hides values.*filled", hidden)


def test_masked_in_batches_and_lists() -> None:
    worlds = numpy.stack([BOXES, BOXES])
    hidden = numpy.ma.MaskedArray(numpy.ones(len(BOXES), numpy.uint32), mask=numpy.arange(len(BOXES)) == 0)
    assert len(throng.find_pairs(worlds, group=numpy.ma.MaskedArray(hidden.data)))
    for group in (hidden, [hidden, hidden]):
        with pytest.raises(ValueError, match="group: found a masked array that hides values.*filled"):
            throng.find_pairs(worlds, group=group)
    row = numpy.ma.MaskedArray(BOXES[0], mask=BOXES[0] == BOXES[0, 0])
    with pytest.raises(ValueError, match="boxes: found a masked array that hides values"):
        throng.find_pairs([row, row])


@EXAMPLES
@given(box_rows(value=any_coordinate, most=8), box_rows(most=3))
def test_nan(boxes: Any, other: Any) -> None:
    bad = numpy.isnan(boxes).any(axis=1)
    clean = numpy.where(bad[:, None], numpy.float32(NAN), boxes)
    rounds: Any = ("outward", "exact")
    for one, round in ((boxes, "exact"), *((boxes.astype(numpy.float64), round) for round in rounds)):
        assert as_pairs(find_pairs(one, other, nan="inactive", round=round)) == brute_force(clean, other)
        if not bad.any():
            continue
        text = f"the first is box {int(bad.argmax())}.*pass nan='inactive'"
        with pytest.raises(ValueError, match=text):
            find_pairs(one, round=round)
        with pytest.raises(ValueError, match=text):
            find_pairs(other, one, round=round)
