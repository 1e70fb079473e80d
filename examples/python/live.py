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
assert result.found == live.pair_count == len(live.pairs) and len(live.ended) > 0
