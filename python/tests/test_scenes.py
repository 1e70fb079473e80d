"""Scenes, files, and boxes of bodies."""

from pathlib import Path
from typing import Any

import numpy
import pytest

import throng


def test_scene() -> None:
    frames = throng.scene("uniform", 1000, frames=3, seed=5, moving=0.5)
    assert frames.shape == (3, 1000, 6) and frames.dtype == numpy.float32
    assert numpy.array_equal(frames, throng.scene("uniform", 1000, 3, None, 5, 0.5))
    moved = (frames[0] != frames[1]).any(axis=1).mean()
    assert 0.4 < moved < 0.6
    denser = throng.find_pairs(throng.scene("uniform", 20000, density=4)[0])
    assert 3 < len(denser) / 20000 < 5
    assert throng.scene("uniform", 0).shape == (1, 0, 6)


def test_worlds() -> None:
    worlds = throng.scene_worlds("worlds", 256)
    assert worlds is not None and worlds.shape == (256,) and set(worlds) == {0, 1, 2, 3}
    assert throng.scene_worlds("uniform", 10) is None


def test_wrong_scene() -> None:
    with pytest.raises(ValueError, match="no scene has the name 'unifrom'; there are: uniform"):
        throng.scene("unifrom", 10)
    with pytest.raises(ValueError, match="objects: found -1"):
        throng.scene("uniform", -1)
    with pytest.raises(TypeError, match="objects: found 1.5"):
        throng.scene("uniform", 1.5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="frames: found 0"):
        throng.scene("uniform", 10, frames=0)
    with pytest.raises(ValueError, match="moving"):
        throng.scene("uniform", 10, moving=2)
    with pytest.raises(TypeError, match="density: found 'high'"):
        throng.scene("uniform", 10, density="high")  # type: ignore[arg-type]
    with pytest.raises(MemoryError):
        throng.scene("uniform", 2**32 - 2**16, frames=2**24)


def test_files(tmp_path: Path) -> None:
    frames = throng.scene("pile", 100, frames=4)
    path = tmp_path / "boxes.npy"
    throng.save_boxes(path, frames)
    assert numpy.array_equal(numpy.load(path), frames)
    assert numpy.array_equal(throng.load_boxes(path), frames)
    throng.save_boxes(str(path), frames[1, ::2])
    assert numpy.array_equal(throng.load_boxes(str(path)), frames[1, ::2])
    numpy.save(path, numpy.asfortranarray(frames.astype(">f8")))
    assert numpy.array_equal(throng.load_boxes(path), frames)
    numpy.save(path, frames.astype(numpy.float64) + 1e-9)
    with pytest.raises(ValueError, match=r"which no float32 equals.*rounding outward \(round='outward'\)"):
        throng.load_boxes(path)
    with pytest.raises(ValueError, match="round: found 'exact', wanted None or 'outward'"):
        throng.load_boxes(path, round="exact")  # type: ignore[arg-type]
    rounded = throng.load_boxes(path, round="outward")
    assert (rounded[..., :3] <= frames[..., :3] + 1e-9).all()
    pairs = throng.find_pairs(frames[0])
    throng.save_pairs(path, pairs)
    assert numpy.array_equal(numpy.load(path), pairs)


def test_wrong_files(tmp_path: Path) -> None:
    path = tmp_path / "boxes.npy"
    with pytest.raises(FileNotFoundError):
        throng.load_boxes(path)
    with pytest.raises(ValueError, match="a directory"):
        throng.load_boxes(tmp_path)
    path.write_bytes(b"not numpy's")
    with pytest.raises(ValueError, match="wanted a NumPy .npy file"):
        throng.load_boxes(path)
    numpy.save(path, numpy.zeros((3, 6), numpy.int32))
    with pytest.raises(ValueError, match="int32"):
        throng.load_boxes(path)
    boxes: Any = numpy.zeros((3, 6), numpy.float32)
    with pytest.raises(OSError, match="wanted a file that can be written"):
        throng.save_boxes("/nowhere/boxes.npy", boxes)
    with pytest.raises(ValueError, match="boxes: found float32 of shape"):
        throng.save_boxes(path, boxes[:, :5])
    with pytest.raises(ValueError, match="found no frame"):
        throng.save_boxes(path, boxes[None][:0])
    with pytest.raises(TypeError, match="pairs: found float32"):
        throng.save_pairs(path, boxes[:, :2])
    assert numpy.load(path).dtype == numpy.int32  # the older file is unchanged


def test_bodies() -> None:
    position = numpy.array([[0, 0, 0], [10, 0, 0], [0, 5, 0], [3, 3, 3]], numpy.float32)
    shapes = [
        throng.box((1, 2, 3)),
        throng.sphere(0.5),
        throng.capsule(1, 0.25),
        throng.convex(0, 2),
    ]
    points = numpy.array([[1, 0, 0], [0, 1, 0]], numpy.float32)
    boxes = throng.update_boxes(position, shapes, points=points)
    wanted: Any = [
        [-1, -2, -3, 1, 2, 3],
        [9.5, -0.5, -0.5, 10.5, 0.5, 0.5],
        [-0.25, 3.75, -0.25, 0.25, 6.25, 0.25],
        [3, 3, 3, 4, 4, 3],
    ]
    assert boxes.dtype == numpy.float32 and numpy.allclose(boxes, wanted, atol=1e-5)
    assert (boxes[:, :3] <= numpy.array(wanted)[:, :3]).all()
    turned = numpy.tile(numpy.array([0, 0, 0.5**0.5, 0.5**0.5], numpy.float32), (4, 1))
    moved = throng.update_boxes(
        position,
        [throng.box((1, 2, 3))],
        rotation=turned,
        displacement=numpy.full((4, 3), 7, numpy.float32),
        margin=1,
    )
    assert numpy.allclose(moved[0], [-3, -2, -4, 10, 9, 11], atol=1e-4)
    which = numpy.array([1, 1, 0, 0])
    by_index = throng.update_boxes(position, shapes[:2], shape=which)
    assert numpy.allclose(by_index[0], [-0.5, -0.5, -0.5, 0.5, 0.5, 0.5], atol=1e-5)
    assert throng.update_boxes(position[:0], []).shape == (0, 6)


def test_bodies_of_float64() -> None:
    random = numpy.random.default_rng(3)
    position = random.normal(0, 100, (50, 3)).astype(numpy.float32)
    rotation = numpy.tile(numpy.array([0, 0.6, 0, 0.8], numpy.float32), (50, 1))
    shapes = [throng.capsule(1, 0.25)]
    wanted = throng.update_boxes(position, shapes, rotation=rotation, displacement=position)
    doubles = position.astype(float)
    for layout in (doubles, numpy.asfortranarray(doubles), numpy.repeat(doubles, 2, axis=0)[::2], doubles[::-1].copy()[::-1]):
        found = throng.update_boxes(layout, shapes, rotation=rotation.astype(float), displacement=layout)
        assert numpy.array_equal(found, wanted)
    assert throng.update_boxes(doubles[:0], shapes).shape == (0, 6)
    doubles[7, 1] = numpy.nan
    assert numpy.isnan(throng.update_boxes(doubles, shapes)[7]).any()
    for name, value in (("position", 0.1), ("displacement", 1e300)):
        doubles = position.astype(float)
        doubles[9, 2] = value
        given: Any = {"position": position, "displacement": position, name: doubles}
        found = throng.update_boxes(shapes=shapes, **given)  # rounded outward
        assert (found[9, 3:] >= (given["position"] + given["displacement"])[9]).all()
    doubles[9, 2] = -numpy.inf
    assert throng.update_boxes(position, shapes, displacement=doubles).shape == (50, 6)


def test_wrong_bodies() -> None:
    position = numpy.zeros((3, 3), numpy.float32)
    with pytest.raises(ValueError, match="the first is body 1: shape 1 has radius -1"):
        throng.update_boxes(position, [throng.sphere(1), throng.sphere(-1), throng.sphere(1)])
    with pytest.raises(ValueError, match="2 shapes for 3 bodies"):
        throng.update_boxes(position, [throng.sphere(1), throng.sphere(1)])
    with pytest.raises(TypeError, match="wanted throng.shape_type"):
        throng.update_boxes(position, [1.0])  # type: ignore[list-item]
    with pytest.raises(ValueError, match=r"rotation: found .* wanted float32 of shape \(3, 4\)"):
        throng.update_boxes(position, [throng.sphere(1)], rotation=position)
    with pytest.raises(TypeError, match=r"position: found int64 .*if nothing is lost by it, position.astype"):
        throng.update_boxes(position.astype(int), [throng.sphere(1)])
    with pytest.raises(ValueError, match=r"rotation: found float64 .* wanted float32 of shape \(3, 4\)"):
        throng.update_boxes(position, [throng.sphere(1)], rotation=position.astype(float))
    with pytest.raises(ValueError, match="must be contiguous"):
        throng.update_boxes(position[:, ::-1], [throng.sphere(1)])
