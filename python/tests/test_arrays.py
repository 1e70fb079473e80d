"""Which arrays are accepted without a copy, and the errors for others."""

import array
from typing import Any

import numpy
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import as_strided
from dlpack import ArrayOnDevice, OnlyDLPack
from reference import NAN, as_pairs, box_rows, brute_force, double, double_rows, find_pairs, grown

import throng
from throng import _throng

BOXES = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [3, 3, 3, 4, 4, 4]], numpy.float32)


def layouts(boxes: Any) -> list[Any]:
    n = len(boxes)
    wide = numpy.full((n, 11), numpy.nan, boxes.dtype)
    wide[:, 3:9] = boxes
    sparse = numpy.full((3 * n, 12), numpy.nan, boxes.dtype)
    sparse[::3, ::2] = boxes
    frozen = boxes.copy()
    frozen.flags.writeable = False
    turned = boxes[:, ::-1].copy()[:, ::-1]  # columns with a negative stride
    return [boxes, wide[:, 3:9], sparse[::3, ::2], numpy.asfortranarray(boxes), frozen, turned,
            memoryview(boxes), boxes.astype(numpy.float64)]  # fmt: skip


def check_layouts(boxes: Any, **options: Any) -> None:
    wanted = brute_force(boxes)
    for layout in layouts(boxes):
        if isinstance(layout, memoryview) and len(boxes) == 0:
            continue
        assert as_pairs(find_pairs(layout, **options)) == wanted
    assert as_pairs(find_pairs((boxes[:, :3], boxes[:, 3:]), **options)) == wanted
    apart = numpy.ascontiguousarray(boxes[:, :3]), numpy.ascontiguousarray(boxes[:, 3:])
    assert as_pairs(find_pairs(apart, **options)) == wanted


@settings(max_examples=100, deadline=None)
@given(box_rows(most=8))
def test_layouts(boxes: Any) -> None:
    check_layouts(boxes)
    check_layouts(boxes, round="exact")


@settings(max_examples=200, deadline=None)
@given(double_rows(most=8))
def test_exact_layouts(boxes: Any) -> None:
    check_layouts(boxes, round="exact")


def test_no_copy() -> None:
    # A view of 4 GB of boxes without their memory.
    one = numpy.array([0, 0, 0, 1, 1, 1], numpy.float32)
    same = numpy.broadcast_to(one, (2000, 6))
    assert len(find_pairs(same)) == 1999 * 1000
    with pytest.raises(ValueError, match="found 4294967296 boxes, at most 4294901760"):
        find_pairs(numpy.broadcast_to(one, (2**32, 6)))
    with pytest.raises(ValueError, match="at most 4294901760"):
        find_pairs(numpy.broadcast_to(one.astype(float), (2**40, 6)))


def test_float64() -> None:
    exact = BOXES.astype(numpy.float64)
    exact[0, 0] = -numpy.inf
    assert as_pairs(find_pairs(exact)) == [(0, 1), (1, 2)]
    exact[1, 4] = 3.1
    # By default compared as float64: one step apart is apart.
    assert as_pairs(find_pairs(exact)) == [(0, 1), (1, 2)]
    exact[2, 1] = numpy.nextafter(3.1, 4)
    assert as_pairs(find_pairs(exact)) == as_pairs(find_pairs((exact[:, :3], exact[:, 3:]))) == [(0, 1)]
    with pytest.raises(ValueError, match=r"at \[1, 4\] is 3.10000\d*, which no float32 equals; give float32"):
        throng.save_boxes("/nowhere/boxes.npy", exact)
    assert as_pairs(find_pairs(exact, round="outward")) == [(0, 1), (1, 2)]
    # 0.1 is between two floats: boxes that touch there as doubles touch as floats, too.
    tenth = numpy.array([[0, 0, 0.1, 0.1], [0.1, 0.1, 1, 1]])
    assert as_pairs(find_pairs(tenth, round="outward")) == [(0, 1)]
    assert as_pairs(find_pairs(numpy.asfortranarray(tenth), round="outward")) == [(0, 1)]
    huge = numpy.array([[-1e300, 0, 0, 1e300, 1, 1], [5, 0, 0, 6, 1, 1]])
    assert as_pairs(find_pairs(huge, round="outward")) == [(0, 1)]
    assert as_pairs(find_pairs(huge)) == [(0, 1)]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.lists(st.floats(), min_size=6, max_size=6), min_size=1, max_size=8))
def test_round_outward_contains(rows: Any) -> None:
    boxes = numpy.array(rows)
    # Points one double step from each corner are in the float box: no overlap is lost.
    found = set(as_pairs(find_pairs(boxes, round="outward", nan="inactive")))
    assert set(brute_force(boxes)) <= found or numpy.isnan(boxes).any()


exact_choices = st.fixed_dictionaries(
    {
        "round": st.just("exact"),
        "order": st.sampled_from(["any", "canonical"]),
        "algorithm": st.sampled_from(["auto", "all-pairs", "grid"]),
        "threads": st.integers(0, 3),
    }
)


@settings(max_examples=300, deadline=None)
@given(double_rows(), exact_choices)
def test_exact(boxes: Any, options: Any) -> None:
    assert as_pairs(find_pairs(boxes, **options)) == brute_force(boxes)


@settings(max_examples=300, deadline=None)
@given(double_rows(most=12), double_rows(most=12), box_rows(most=12), exact_choices)
def test_exact_two_sets(a: Any, b: Any, floats: Any, options: Any) -> None:
    for one, other in ((a, b), (a, floats), (floats, a), (floats, floats), (a, floats.astype(float))):
        assert as_pairs(find_pairs(one, other, **options)) == brute_force(one, other)


@settings(max_examples=200, deadline=None)
@given(double_rows(columns=4), box_rows(columns=4, most=8), exact_choices)
def test_exact_flat(boxes: Any, floats: Any, options: Any) -> None:
    corners = boxes[:, :2], boxes[:, 2:]
    assert as_pairs(find_pairs(boxes, **options)) == brute_force(boxes)
    assert as_pairs(find_pairs(corners, **options)) == brute_force(boxes)
    assert as_pairs(find_pairs(corners, floats, **options)) == brute_force(boxes, floats)
    assert as_pairs(find_pairs(floats, corners, **options)) == brute_force(floats, boxes)


@settings(max_examples=200, deadline=None)
@given(double_rows(most=8), box_rows(most=4), st.floats(0, 3, width=32) | st.sampled_from([2.0**-149, 1e9]))
def test_exact_margin(boxes: Any, floats: Any, margin: float) -> None:
    options: Any = {"round": "exact", "margin": margin}
    large = grown(boxes, margin)
    assert as_pairs(find_pairs(boxes, **options)) == brute_force(large)
    assert as_pairs(find_pairs(floats, boxes, **options)) == brute_force(grown(floats, margin), large)


@settings(max_examples=200, deadline=None)
@given(double_rows(value=double | st.just(NAN)), box_rows(most=3))
def test_exact_nan(boxes: Any, floats: Any) -> None:
    bad = numpy.isnan(boxes).any(axis=1)
    clean = numpy.where(bad[:, None], NAN, boxes)
    assert as_pairs(find_pairs(boxes, round="exact", nan="inactive")) == brute_force(clean)
    if bad.any():
        text = f"the first is box {int(bad.argmax())}.*pass nan='inactive'"
        with pytest.raises(ValueError, match=text):
            find_pairs(boxes, round="exact")
        with pytest.raises(ValueError, match=text):
            find_pairs(floats, boxes, round="exact")


def rows_of_adjacent_rods(n: int, at: float) -> Any:
    """(n, 6) float64: adjacent rods that alternately touch the next, or miss it by one step."""
    boxes = numpy.zeros((n, 6))
    boxes[:, 3] = at + numpy.arange(1, n + 1)
    boxes[1:, 0] = boxes[:-1, 3]
    boxes[0, 0] = at
    boxes[1::2, 0] = numpy.nextafter(boxes[1::2, 0], numpy.inf)
    boxes[:, [1, 2, 4, 5]] = at
    return boxes


@pytest.mark.parametrize("at", [0.0, 0.1, -1e9, 1e9, 1e15])
def test_exact_far_from_the_origin(at: float) -> None:
    boxes = rows_of_adjacent_rods(1001, at)
    wanted = [(i, i + 1) for i in range(1, 1000, 2)]
    assert as_pairs(find_pairs(boxes, round="exact")) == wanted == brute_force(boxes)
    half = boxes[::2], boxes[1::2]
    assert as_pairs(find_pairs(*half, round="exact")) == brute_force(*half)
    records = numpy.full((1001, 17), numpy.nan)
    records[:, 3:15:2] = boxes
    assert as_pairs(find_pairs(records[:, 3:15:2], round="exact")) == wanted
    assert len(find_pairs(boxes, round="outward")) > 500


def test_exact_filters() -> None:
    random = numpy.random.default_rng(7)
    boxes = random.integers(0, 3, (400, 6)) + 1e9
    floats = boxes[:50].astype(numpy.float32)
    value = {"group": 4, "mask": 8, "owner": 9, "world": 3, "static": 2}
    f: Any = {name: random.integers(1 if value[name] > 3 else 0, value[name], 400) for name in value}
    allowed = (f["group"][:, None] & f["mask"] != 0) & (f["group"] & f["mask"][:, None] != 0)
    allowed &= (f["owner"][:, None] != f["owner"]) & (f["world"][:, None] == f["world"])
    allowed &= f["static"][:, None] + f["static"] < 2
    found = as_pairs(find_pairs(boxes, **f, round="exact"))
    assert found == [pair for pair in brute_force(boxes) if allowed[pair]] != []
    # A float32 set keeps its filters when it is copied.
    both = {k: v[:50] for k, v in f.items()} | {"other_" + k: v for k, v in f.items()}
    found = as_pairs(find_pairs(floats, boxes, **both, round="exact"))
    assert found == [pair for pair in brute_force(floats, boxes) if allowed[pair]] != []


def test_exact_is_for_float64_on_the_cpu() -> None:
    none = numpy.zeros((0, 6))
    for pair in ((none, none), (BOXES, none), (none, BOXES), (none[:, :4], BOXES)):
        assert find_pairs(*pair, round="exact").shape == (0, 2)
    assert find_pairs(none, round="exact").shape == (0, 2)
    one = numpy.array([0, 0, 0, 1, 1, 1.1])
    assert len(find_pairs(numpy.broadcast_to(one, (2000, 6)), round="exact")) == 1999 * 1000
    # float32 alone: the option has no effect.
    assert len(find_pairs(BOXES, BOXES, round="exact", backend="emulated")) == 7
    for backend in ("emulated", "cuda"):
        kind: Any = backend
        with pytest.raises(ValueError, match=f"backend {backend}: boxes of float64 are searched on the CPU alone; pass round='outward'"):
            find_pairs(BOXES.astype(float), round="exact", backend=kind)
        with pytest.raises(ValueError, match="boxes of float64"):
            find_pairs(BOXES, BOXES.astype(float), round="exact", backend=kind)
    assert as_pairs(find_pairs(OnlyDLPack(BOXES.astype(float)), round="exact")) == [(0, 1), (1, 2)]


WRONG_FOR_EXACT = [
    ((BOXES[:, :3].astype(float), BOXES[:, 3:]), "of one type and shape"),
    (BOXES.astype(float)[:, :5], r"found float64 of shape \(3, 5\)"),
    (numpy.ones(100, numpy.uint8)[4:].view(numpy.float64).reshape(2, 6), "not a multiple of 8.*copy"),
    (numpy.broadcast_to(numpy.zeros(6), (2**32, 6)), "found 4294967296 boxes, at most 4294901760"),
]


@pytest.mark.parametrize("boxes, text", WRONG_FOR_EXACT)
def test_wrong_for_exact(boxes: Any, text: str) -> None:
    for name, sets in (("boxes", (boxes,)), ("boxes", (boxes, BOXES)), ("other", (BOXES, boxes))):
        with pytest.raises(ValueError, match=text) as caught:
            find_pairs(*sets, round="exact")
        assert str(caught.value).startswith(name)


def test_dlpack() -> None:
    assert as_pairs(find_pairs(OnlyDLPack(BOXES))) == [(0, 1), (1, 2)]
    corners = OnlyDLPack(BOXES[:, :3]), OnlyDLPack(BOXES[:, 3:])
    owner = OnlyDLPack(numpy.array([4, 4, -1]))
    assert as_pairs(find_pairs(corners, owner=owner)) == [(1, 2)]


WRONG = [
    ([[0, 0, 0, 1, 1]], ValueError, r"boxes: found float64 of shape \(1, 5\)"),
    ([[0, 0, 0, 1, 1, 1], [0, 0]], ValueError, "boxes: found a list that makes no array: its parts differ in length"),
    ([[0, 0, 0, 1, 1, "1"]], TypeError, r"boxes: found a .*, wanted an array of float32"),
    ([[0, 0, 0, 1, 1, 2**53 + 1]], ValueError, r"boxes: found an integer of 2\*\*53 or more in a list"),
    ([None], TypeError, "boxes: found a"),
    (None, TypeError, "boxes: found None"),
    (7, TypeError, "boxes: found 7"),
    ("boxes.npy", TypeError, "found 'boxes.npy'"),
    (BOXES.astype(numpy.int32), TypeError, "found int32 of shape"),
    (BOXES.astype(numpy.float16), TypeError, "found float16"),
    (BOXES.astype(numpy.complex64), TypeError, "found complex64"),
    (BOXES.astype(bool), TypeError, "found bool"),
    (BOXES.astype(object), TypeError, "dtype object"),
    (BOXES.astype(">f4"), TypeError, "dtype >f4"),
    (BOXES.astype("S4"), TypeError, "dtype"),
    (array.array("d", [1.0] * 6), ValueError, r"found float64 of shape \(6,\)"),
    (BOXES[0], ValueError, r"found float32 of shape \(6,\)"),
    (BOXES[None, None], ValueError, r"found float32 of shape \(1, 1, 3, 6\)"),
    (BOXES[:, :5], ValueError, r"of shape \(3, 5\)"),
    (BOXES[:, :3], ValueError, r"of shape \(3, 3\)"),
    (BOXES[::-1], ValueError, "rows run backwards.*ascontiguousarray"),
    ((BOXES[:, :3],), ValueError, r"found float32 of shape \(1, 3, 3\)"),
    ((BOXES[:, :3], BOXES[:2, 3:]), ValueError, r"upper of float32 of shape \(2, 3\)"),
    ((BOXES[:, :3], BOXES[:, 3:].astype(float)), ValueError, "of one type and shape"),
    ((BOXES[:, :3], BOXES[:, 3:].copy()), ValueError, "24 bytes apart and.*12"),
    ((BOXES[:, :3], None), TypeError, r"boxes\[1\]: found None"),
    ((BOXES, BOXES), ValueError, r"boxes\[0\]: found float32 of shape \(3, 6\)"),
    (numpy.ones(49, numpy.uint8)[1:].view(numpy.float32).reshape(2, 6), ValueError, "copy"),
    (ArrayOnDevice((10, 0)), ValueError, "device type 10"),
    (ArrayOnDevice("cuda"), TypeError, "__dlpack_device__"),
]


@pytest.mark.parametrize("boxes, kind, text", WRONG)
def test_wrong(boxes: Any, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind, match=text) as caught:
        find_pairs(boxes)
    assert str(caught.value).startswith("boxes")
    if boxes is not None:
        with pytest.raises(kind) as caught:
            find_pairs(BOXES, boxes)
        assert str(caught.value).startswith("other")


def test_used_capsule() -> None:
    capsule: Any = BOXES.__dlpack__()
    assert len(find_pairs(capsule)) == 2
    with pytest.raises(TypeError, match="boxes: found a PyCapsule"):
        find_pairs(capsule)


def test_dimensions_do_not_mix() -> None:
    with pytest.raises(ValueError, match="other: found 2-D boxes and 3-D"):
        find_pairs(BOXES, BOXES[:, [0, 1, 3, 4]])


def test_wrong_filters() -> None:
    def refuses(kind: type[Exception], text: str, **filters: Any) -> None:
        with pytest.raises(kind, match=text):
            find_pairs(BOXES, **filters)

    refuses(TypeError, "group: found float64", group=numpy.ones(3))
    refuses(TypeError, r"mask: found a str.*asarray\(x, dtype=numpy.uint32\)|mask: found '12'", mask="12")
    refuses(TypeError, "owner: found float64 of shape", owner=[1.0, 2.0, 3.0])
    refuses(ValueError, "static: found .* that makes no array", static=[[1], 0, 1])
    refuses(TypeError, "world: found 1.5", world=1.5)
    refuses(TypeError, "world: found .*1.5.*, wanted an integer, or int32", world=numpy.float64(1.5))
    refuses(ValueError, "group: found -1, wanted 0 to 4294967295", group=-1)
    refuses(ValueError, "owner: found 1180591620717411303424, wanted", owner=2**70)
    refuses(ValueError, "world below -1, the first is box 0", world=-2)
    refuses(ValueError, "mask: the value at 0 is 18446744073709551615, wanted", mask=numpy.full(3, 2**64 - 1, "u8"))
    refuses(TypeError, "owner: found bool", owner=numpy.ones(3, bool))
    refuses(ValueError, r"owner: found int32 of shape \(2,\)", owner=numpy.ones(2, numpy.int32))
    refuses(ValueError, "group: the value at 1 is -1, wanted 0 to 4294967295", group=numpy.array([1, -1, 2]))
    refuses(ValueError, "owner: the value at 2 is 2147483648, wanted -2147483648 to 2147483647", owner=numpy.array([1, 2, 2**31]))
    refuses(ValueError, "static: the value at 0 is 256, wanted 0 to 255", static=numpy.array([256, 0, 0]))
    refuses(ValueError, "world below -1, the first is box 1", world=numpy.array([0, -2, 0]))
    refuses(ValueError, "other: found None", other_world=numpy.zeros(3, numpy.int32))
    backwards = numpy.array([0, 1, 2], numpy.int32)[::-1]
    assert as_pairs(find_pairs(BOXES, owner=backwards)) == [(0, 1), (1, 2)]


def test_wrong_options() -> None:
    def refuses(kind: type[Exception], text: str, **options: Any) -> None:
        with pytest.raises(kind, match=text):
            find_pairs(BOXES, **options)

    refuses(ValueError, "order: found 'sorted', wanted one of 'any', 'canonical'", order="sorted")
    refuses(TypeError, "order: found 1", order=1)
    refuses(ValueError, "algorithm: found 'bvh'", algorithm="bvh")
    refuses(ValueError, "nan: found ''", nan="")
    refuses(ValueError, "round: found 'inward', wanted 'exact' or 'outward'", round="inward")
    refuses(ValueError, "round: found None", round=None)
    refuses(ValueError, "dtype: found 'int32', wanted 'uint32' or 'int64'", dtype="int32")
    refuses(ValueError, "dtype: found None", dtype=None)
    refuses(ValueError, "dtype: found 7", dtype=7)
    refuses(ValueError, "round: found True", round=True)
    for name in ("order", "algorithm", "backend", "nan", "isa", "round"):
        refuses(ValueError, rf"{name}: found '\\ud800', wanted", **{name: "\ud800"})  # not UTF-8
    refuses(ValueError, "isa: found 'mmx'", isa="mmx")
    refuses(ValueError, "threads: found -1", threads=-1)
    refuses(TypeError, "threads: found 1.5", threads=1.5)
    refuses(ValueError, "margin: found -0.5", margin=-0.5)
    refuses(ValueError, "margin: found nan", margin=float("nan"))
    refuses(ValueError, "margin: found 1e.39", margin=1e39)
    refuses(TypeError, "margin: found 'x'", margin="x")
    if not _throng.has_cuda:
        refuses(RuntimeError, "no GPU backend; use backend='cpu'", backend="cuda")


types = st.sampled_from("? b B h H i I q Q e f d g F D >f4 >f8 <f4 O S3 U2 M8[s]".split())


@settings(max_examples=1000, deadline=None)
@given(
    types,
    st.lists(st.integers(0, 7), max_size=3),
    st.lists(st.integers(-9, 9), min_size=3, max_size=3),
    st.integers(0, 3),
    st.booleans(),
)
def test_no_array_crashes(kind: str, shape: Any, strides: Any, offset: int, two: bool) -> None:
    """Any type, shape, strides and device: accepted, or a conventional exception."""
    dtype = numpy.dtype(kind)
    memory = numpy.zeros(4096, numpy.uint8)[1024 + offset :]
    steps = [s * (dtype.itemsize if two else 2) for s in strides[: len(shape)]]
    if dtype == object:
        made: Any = numpy.zeros(shape, object)
    else:
        made = as_strided(memory[: 8 * dtype.itemsize].view(dtype), shape, steps)
    for call in (
        lambda: find_pairs(made),
        lambda: find_pairs((made, made)),
        lambda: find_pairs(BOXES, made, round="outward", nan="inactive"),
        lambda: find_pairs(made, round="exact", nan="inactive"),
        lambda: find_pairs((made, made), BOXES, round="exact", nan="inactive"),
        lambda: find_pairs(BOXES, group=made, world=made, static=made),
        lambda: throng.update_boxes(made, [throng.sphere(1)], rotation=made),
        lambda: throng.save_boxes("/nowhere/boxes.npy", made),
    ):
        try:
            call()
        except (TypeError, ValueError, OSError) as error:
            assert len(str(error)) > 10
