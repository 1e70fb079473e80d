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
# Compared as float64: a billion units away, separated by one float64 step.
far = numpy.array([[0, 0, 0, 0.1, 1, 1], [0.1, 0, 0, 1, 1, 1]]) + 1e9
far[1, 0] = numpy.nextafter(far[0, 3], numpy.inf)
apart = throng.find_pairs(far)

# As float32, rounded outward: no pair is lost, and boxes this close touch.
touching = throng.find_pairs(far, round="outward")
# snippet-end: doubles
assert len(apart) == 0 and touching.tolist() == [[0, 1]]

# snippet-begin: small
pairs = throng.find_pairs([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3]], group=1)  # lists; one group for all

broad_phase = throng.BroadPhase()
broad_phase.add([0, 0, 0, 1, 1, 1], owner=7)  # one box
broad_phase.move(0, [4, 4, 4, 5, 5, 5])  # one id
# snippet-end: small
assert pairs.tolist() == [[0, 1]] and broad_phase.box(0).tolist() == [4, 4, 4, 5, 5, 5]

# snippet-begin: filters
boxes = throng.scene("worlds", 64000)[0]  # 1000 worlds at the same place
world = throng.scene_worlds("worlds", 64000)  # int32: the world of each box
ground = numpy.zeros(64000, bool)
ground[::64] = True  # the first of each world never moves
within = throng.find_pairs(boxes, world=world, static=ground)
# snippet-end: filters
assert world is not None and (world[within[:, 0]] == world[within[:, 1]]).all()

# snippet-begin: worlds
batch = boxes.reshape(1000, 64, 6)
world_of_pair, first, second = throng.find_pairs(batch).T
touched = batch[world_of_pair, first]  # (m, 6): the first box of each pair

table = numpy.array([[-9, -9, -1, 9, 9, 0]], numpy.float32)
on_table = throng.find_pairs(batch, table)  # a second set that each world has
# snippet-end: worlds
assert (world == numpy.repeat(numpy.arange(1000), 64)).all()
assert len(touched) == len(throng.find_pairs(boxes, world=world)) > 1000
assert on_table.shape[1] == 3

rays = numpy.array([[0.1, 0.5, -9, 0.1, 0.5, 9]], numpy.float32)
hits = throng.find_pairs(rays, boxes)  # first: index of the ray; second: index of the box
assert (hits[:, 0] == 0).all()
