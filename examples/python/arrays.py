"""Layouts of boxes: two corner arrays, columns of wider records, 2-D, doubles; filters."""

import numpy
import throng

# snippet-begin: layouts
lower = numpy.random.default_rng(1).random((1000, 3), dtype=numpy.float32)
upper = lower + numpy.float32(0.1)
pairs = throng.find_pairs((lower, upper))  # two corner arrays

records = numpy.zeros((1000, 16), numpy.float32)
records[:, 4:7], records[:, 7:10] = lower, upper
same = throng.find_pairs(records[:, 4:10])  # columns of wider rows: no copy

flat = throng.find_pairs((lower[:, :2], upper[:, :2]))  # 2-D
# snippet-end: layouts
assert len(pairs) == len(same) < len(flat)

# snippet-begin: doubles
# 0.1 is not a float32. Rounding outward loses no touching pair.
doubles = numpy.array([[0, 0, 0, 0.1, 1, 1], [0.1, 0, 0, 1, 1, 1]])
touching = throng.find_pairs(doubles, round="outward")

# Compared as float64: a billion units away, separated by one float64 step.
far = doubles + 1e9
far[1, 0] = numpy.nextafter(far[0, 3], numpy.inf)
apart = throng.find_pairs(far, round="exact")
# snippet-end: doubles
assert touching.tolist() == [[0, 1]]
assert len(apart) == 0 and len(throng.find_pairs(far, round="outward")) == 1

# snippet-begin: filters
boxes = throng.scene("worlds", 64000)[0]  # 1000 worlds at the same place
world = throng.scene_worlds("worlds", 64000)  # int32: the world of each box
ground = numpy.zeros(64000, bool)
ground[::64] = True  # the first of each world never moves
within = throng.find_pairs(boxes, world=world, static=ground)
# snippet-end: filters
assert world is not None and (world[within[:, 0]] == world[within[:, 1]]).all()

rays = numpy.array([[0.1, 0.5, -9, 0.1, 0.5, 9]], numpy.float32)
hits = throng.find_pairs(rays, boxes)  # first: index of the ray; second: index of the box
assert (hits[:, 0] == 0).all()
