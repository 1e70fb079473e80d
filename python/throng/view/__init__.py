"""Pictures of boxes: show(boxes, pairs) makes a page for a notebook or a browser.

`python -m throng.view FILE.npy` shows boxes over time: solid, coloured by their number of overlaps; pairs as
lines, begun and ended pairs, the grid's cells and their occupancy, stage times and counts as curves,
the largest boxes and the densest cells as lists. That needs Rerun: `pip install rerun-sdk`.
"""

from throng.view._frame import Frame, frames
from throng.view._page import Page, show
from throng.view._record import record

__all__ = ["Frame", "Page", "frames", "record", "show"]
