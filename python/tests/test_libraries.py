"""PyTorch's tensors and JAX's arrays on the CPU; skipped where the library is not installed."""

from typing import Any

import numpy
import pytest
from reference import as_pairs

import throng

BOXES = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [3, 3, 3, 4, 4, 4]], numpy.float32)
PAIRS = [(0, 1), (1, 2)]


def pairs_of(library: Any, boxes: Any, **options: Any) -> list[tuple[int, int]]:
    """By both kinds of result, which must be equal."""
    found = throng.find_pairs(boxes, result="same", **options)
    one = boxes[0] if isinstance(boxes, tuple) else boxes
    assert isinstance(found, type(one)) or isinstance(found, library.Tensor)
    assert found.dtype == library.uint32 and found.shape[1:] == (2,)
    as_numpy = throng.find_pairs(boxes, **options)
    assert type(as_numpy) is numpy.ndarray
    pairs = as_pairs(numpy.asarray(found))
    assert pairs == as_pairs(as_numpy)
    return pairs


def test_torch_layouts() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    boxes = torch.from_numpy(BOXES)
    wide = torch.full((3, 9), float("nan"))
    wide[:, 2:8] = boxes
    columns = boxes.t().contiguous().t()
    every_other = torch.stack([boxes, boxes + 50], dim=1)[:, 0]
    for layout in (boxes, wide[:, 2:8], columns, every_other, boxes.double(), (boxes[:, :3], boxes[:, 3:])):
        assert pairs_of(torch, layout) == PAIRS
    assert pairs_of(torch, boxes[:1].expand(3, 6)) == [(0, 1), (0, 2), (1, 2)]
    for few in (boxes[:0], boxes[:1], boxes[::2]):
        assert pairs_of(torch, few) == []
    assert pairs_of(torch, boxes.double() + 0.1, round="outward") == PAIRS
    with pytest.raises(ValueError, match="which no float32 equals"):
        throng.find_pairs(boxes.double() + 0.1)
    # Read in place: writes to the tensor's memory change the result.
    finder = throng.Finder()
    shared = boxes.clone()
    assert len(finder.find(shared)) == 2
    shared[2] += 9
    assert as_pairs(finder.find(shared)) == [(0, 1)]


def test_torch_flags() -> None:
    """Tensors whose memory does not hold their values, or which DLPack refuses."""
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    boxes = torch.from_numpy(BOXES)
    recorded = boxes.clone().requires_grad_()
    for tensor in (recorded, recorded * 1, torch.nn.Parameter(boxes.clone())):
        assert pairs_of(torch, tensor) == PAIRS
        assert throng.BroadPhase().add(tensor).tolist() == [0, 1, 2]
    assert recorded.requires_grad and recorded.grad is None
    flagged = torch.view_as_complex(torch.stack([-boxes, -boxes], dim=2)).conj().imag
    assert flagged.is_neg() and torch.equal(flagged, boxes)
    assert pairs_of(torch, flagged) == PAIRS
    assert pairs_of(torch, (flagged[:, :3], flagged[:, 3:])) == PAIRS
    with torch.inference_mode():
        assert pairs_of(torch, boxes * 1) == PAIRS


def test_torch_filters() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    boxes = torch.from_numpy(BOXES)
    for kind in (torch.bool, torch.uint8):
        assert pairs_of(torch, boxes, static=torch.tensor([1, 1, 0]).to(kind)) == [(1, 2)]
    for kind in (torch.int64, torch.int32, torch.int16):
        assert pairs_of(torch, boxes, owner=torch.tensor([4, 4, -1], dtype=kind)) == [(1, 2)]
        assert pairs_of(torch, boxes, world=torch.tensor([0, 0, 1], dtype=kind)) == [(0, 1)]
    group = torch.tensor([1, 2, 3], dtype=torch.uint32)
    assert pairs_of(torch, boxes, group=group, mask=group) == [(1, 2)]
    assert as_pairs(throng.find_pairs(BOXES, static=torch.tensor([True, True, False]))) == [(1, 2)]


def test_torch_refused() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    boxes = torch.from_numpy(BOXES)
    for kind in (torch.float16, torch.bfloat16, torch.int32):
        with pytest.raises(TypeError, match=r"boxes: found .* of a PyTorch tensor boxes.float\(\)"):
            throng.find_pairs(boxes.to(kind))
    for wrong in (boxes.to("meta"), boxes.to_sparse()):
        with pytest.raises((TypeError, ValueError), match="boxes: found a"):
            throng.find_pairs(wrong)


def test_torch_persistent_objects() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    boxes = torch.from_numpy(BOXES)
    live = throng.BroadPhase()
    ids = torch.from_numpy(live.add(boxes).astype(numpy.int64))
    live.update()
    live.move(ids[:1], boxes[:1] + 50)
    live.update()
    assert [tuple(pair)[:2] for pair in live.ended] == [(0, 1)]
    position = torch.zeros(2, 3, requires_grad=True)
    assert throng.update_boxes(position, [throng.sphere(1)]).shape == (2, 6)
    assert throng.Finder().explain(boxes).result.found == 2


def test_jax() -> None:
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    jax.config.update("jax_platforms", "cpu")
    jnp = jax.numpy
    boxes = jnp.asarray(BOXES)
    found = throng.find_pairs(boxes, result="same")
    assert isinstance(found, jax.Array) and found.dtype == jnp.uint32 and as_pairs(numpy.asarray(found)) == PAIRS
    assert type(throng.find_pairs(boxes)) is numpy.ndarray
    assert as_pairs(throng.find_pairs((boxes[:, :3], boxes[:, 3:]))) == PAIRS
    assert throng.find_pairs(boxes[:0], result="same").shape == (0, 2)
    assert as_pairs(throng.find_pairs(boxes, static=jnp.array([True, True, False]))) == [(1, 2)]
    assert as_pairs(throng.find_pairs(boxes, owner=jnp.array([4, 4, -1]))) == [(1, 2)]
    assert boxes[found].shape == (2, 2, 6)
    with pytest.raises(TypeError, match="boxes: found bfloat16"):
        throng.find_pairs(boxes.astype(jnp.bfloat16))
    with pytest.raises(TypeError, match="boxes: found a jax.*Tracer"):
        jax.jit(throng.find_pairs)(boxes)
