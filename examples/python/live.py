"""Objects that live: what began, what ended."""

import numpy
import throng

boxes = throng.scene("uniform", 10000)[0]

# snippet-begin: live
live = throng.BroadPhase()
ids = live.add(boxes)
live.update()

awake = ids[:100]
live.move(awake, boxes[:100] + numpy.float32(0.5))  # what is not moved costs nothing
result = live.update()
for first, second, slot in live.begun:
    pass  # the pair's slot is its own while it lives: a place for the contact
# snippet-end: live

# snippet-begin: hits
origin = numpy.array([[0, 5, 5], [5, 5, -2]], numpy.float32)
direction = numpy.array([[30, 0, 0], [0, 0, 30]], numpy.float32)
pairs, times = live.find_hits((origin, origin), direction, which="first")
for (ray, object_id), when in zip(pairs, times):
    print(f"ray {ray} meets object {object_id} at {origin[ray] + when * direction[ray]}")
# snippet-end: hits
assert len(pairs) > 0

# snippet-begin: query
query = throng.BroadPhaseQuery(threads=1)  # one a thread
met = query.find_overlaps(live, boxes[:10])  # box, object
pairs, times = query.find_hits(live, (origin, origin), direction)
# snippet-end: query
assert len(met) >= 10 and len(pairs) > 0
assert result.found == live.pair_count == len(live.pairs) and len(live.ended) > 0
