"""From bodies to boxes to pairs."""

import numpy
import throng

shapes = [
    throng.box((numpy.inf, 1, numpy.inf), center=(0, -1, 0)),  # the ground, its top at 0
    throng.sphere(0.5),
    throng.capsule(0.5, 0.25),
]
position = numpy.array([[0, 0, 0], [0, 0.5, 0], [1.2, 2, 0]], numpy.float32)
velocity = numpy.array([[0, 0, 0], [0, 0, 0], [0, -200, 0]], numpy.float32)
boxes = throng.update_boxes(position, shapes, displacement=velocity / 60)
pairs = throng.find_pairs(boxes)
assert sorted(map(tuple, pairs.tolist())) == [(0, 1), (0, 2)]
