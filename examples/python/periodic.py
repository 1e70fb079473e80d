"""A periodic domain: boxes touch across its sides."""

import itertools

import numpy
import throng
from numpy.typing import NDArray

# One of each two opposite shifts: a pair across the left side is also a pair across the right.
SHIFTS = [s for s in itertools.product((-1, 0, 1), repeat=3) if s > (0, 0, 0)]
Numbers = NDArray[numpy.integer]


def periodic_pairs(
    boxes: NDArray[numpy.float32], lengths: tuple[float, float, float]
) -> tuple[Numbers, Numbers, Numbers]:
    """first, second (m,), shift (m, 3): box second, moved by shift * lengths, touches box first.

    boxes: (n, 6), centers in the domain, none longer than the domain; lengths: of the domain.
    """
    count = len(boxes)
    images, image_of, shift = [boxes.astype(float)], [numpy.arange(count)], [numpy.zeros((count, 3), int)]
    for s in SHIFTS:
        moved = boxes + numpy.tile(numpy.multiply(s, lengths), 2)  # doubles
        near = (moved[:, :3] <= boxes[:, 3:].max(0)) & (moved[:, 3:] >= boxes[:, :3].min(0))
        which = numpy.flatnonzero(near.all(1))
        images.append(moved[which])
        image_of.append(which)
        shift.append(numpy.tile(s, (len(which), 1)))
    everything, owner, shifts = map(numpy.concatenate, (images, image_of, shift))
    # Two images never pair (static), nor a box and its own image (owner).
    is_image = numpy.arange(len(everything)) >= count
    pairs = throng.find_pairs(everything, owner=owner, static=is_image, round="outward", result="numpy")
    first, second = pairs.T
    return first, owner[second], shifts[second]


random = numpy.random.default_rng(1)
center = random.integers(0, 8 * 16, (500, 3)) / 16
half = random.integers(0, 12, (500, 3)) / 16
boxes = numpy.hstack([center - half, center + half]).astype(numpy.float32)
first, second, shift = periodic_pairs(boxes, (8, 8, 8))
found = set()
for a, b, (x, y, z) in zip(first.tolist(), second.tolist(), shift.tolist()):
    found.add((a, b, x, y, z) if a < b else (b, a, -x, -y, -z))
wanted = set()
for x, y, z in itertools.product((-1, 0, 1), repeat=3):
    moved = boxes + numpy.array([x, y, z, x, y, z], numpy.float32) * 8
    touch = (boxes[:, None, :3] <= moved[None, :, 3:]) & (boxes[:, None, 3:] >= moved[None, :, :3])
    wanted |= {(a, b, x, y, z) for a, b in numpy.argwhere(touch.all(2)).tolist() if a < b}
assert found == wanted and len(found) == len(first)
assert any(row[2:] != (0, 0, 0) for row in found)
