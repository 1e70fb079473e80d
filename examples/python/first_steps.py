"""The shortest use: boxes in, pairs out."""

# snippet-begin: whole
import numpy
import throng

boxes = numpy.array([
    [0, 0, 0, 2, 2, 2],  # lower x, y, z, upper x, y, z
    [1, 1, 1, 3, 3, 3],  # overlaps box 0
    [3, 1, 1, 4, 2, 2],  # touches box 1: that counts
    [9, 9, 9, 9, 9, 9],  # a point, far away
], dtype=numpy.float32)
for first, second in throng.find_pairs(boxes):
    print(first, "touches", second)
# snippet-end: whole

assert throng.find_pairs(boxes, order="canonical").tolist() == [[0, 1], [1, 2]]
