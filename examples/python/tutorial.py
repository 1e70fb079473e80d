"""The program of docs/tutorials/python.md, and more of the same objects."""

# snippet-begin: frames
import numpy
import throng

scene = throng.scene("pile", 2000, frames=5)  # (frames, boxes, 6) float32
finder = throng.Finder()  # keeps its memory from frame to frame
for boxes in scene:
    pairs = finder.find(boxes)
    result = finder.result
    print(f"{result.found} pairs in {result.times.total_ms:.2f} ms by {result.plan.algorithm}")
# snippet-end: frames

total = 0


def narrow_phase(block: throng.Array) -> None:
    global total
    total += 1


capped = throng.Finder(memory_cap=64 << 20)  # everything that the library allocates, in bytes
result = capped.consume(boxes, narrow_phase)  # one block per call; return False to stop
assert result.found == len(pairs) and total > 0

# snippet-begin: persistent
broad_phase = throng.BroadPhase()
ids = broad_phase.add(boxes)
broad_phase.update()

moving = ids[:100]
broad_phase.move(moving, boxes[:100] + numpy.float32(0.5))  # other objects cost nothing
result = broad_phase.update()
print(f"{len(broad_phase.begun)} pairs began, {len(broad_phase.ended)} ended, {result.found} exist")
for first, second, slot in broad_phase.begun[:3]:
    print(f"contact {slot}: objects {first} and {second}")
# snippet-end: persistent
assert result.found == broad_phase.pair_count == len(broad_phase.pairs) and len(broad_phase.ended) > 0

# snippet-begin: ray
above = boxes[500, :3] + numpy.array([0.1, 0.1, 100], numpy.float32)
hit = broad_phase.raycast(above, (0, 0, -1), max_distance=200)
if hit is not None:
    print(f"the ray hits object {hit.object} after {hit.distance:g}, at {hit.point}, normal {hit.normal}")
# snippet-end: ray
assert hit is not None and hit.normal == (0, 0, 1)

# snippet-begin: rays
origins = boxes[:, :3] + numpy.array([0.1, 0.1, 100], numpy.float32)  # one ray per row
directions = numpy.full_like(origins, (0, 0, -200))
hits, times = broad_phase.find_hits((origins, origins), directions, which="first")
# snippet-end: rays
assert len(hits) > 1900 and [500, hit.object] in hits.tolist()

# snippet-begin: query
query = throng.BroadPhaseQuery(threads=1)  # one per thread
overlaps = query.find_overlaps(broad_phase, boxes[:10])  # box, object
hits, times = query.find_hits(broad_phase, (origins, origins), directions)
# snippet-end: query
assert len(overlaps) >= 10 and len(hits) > 0

# snippet-begin: explain
explanation = finder.explain(boxes)
print(f"{explanation.tests_per_box:.1f} tests per box; {explanation.occupied} of {explanation.cells} cells used")
for cell in explanation.densest[:3]:
    print(f"{cell.boxes} boxes between {cell.bounds[:3]} and {cell.bounds[3:]}")
for advice in explanation.advice:
    print(advice)
# snippet-end: explain
assert explanation.result.found == len(pairs)

# snippet-begin: show
import throng.view

page = throng.view.show(boxes, finder.find(boxes))
page  # in a notebook, the last line of a cell draws it
# snippet-end: show
assert page.path.exists()
page.path.unlink()
