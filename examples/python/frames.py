"""A simulation: frame after frame, and pairs in blocks."""

import throng

scene = throng.scene("pile", 2000, frames=5)

# snippet-begin: frames
finder = throng.Finder()  # keeps its memory from frame to frame
for boxes in scene:
    pairs = finder.find(boxes)
    result = finder.result
    print(f"{result.found} pairs in {result.times.total_ms:.2f} ms by {result.plan.algorithm}")
# snippet-end: frames

total = 0


def narrow_phase(pairs: throng.Array) -> None:
    global total
    total += 1


# snippet-begin: consume
capped = throng.Finder(memory_cap=64 << 20)  # all that the library may take, in bytes
result = capped.consume(boxes, narrow_phase)  # a block at a time; False from it stops the search
# snippet-end: consume
assert result.found == len(pairs) and total > 0

# snippet-begin: explain
told = finder.explain(boxes)
print(f"{told.tests_per_box:.1f} tests a box; {told.occupied} of {told.cells} cells have boxes")
for cell in told.densest[:3]:
    print(f"{cell.boxes} boxes between {cell.bounds[:3]} and {cell.bounds[3:]}")
for advice in told.advice:
    print(advice)
# snippet-end: explain
assert told.result.found == len(pairs)
