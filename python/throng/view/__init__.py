"""Viewer for boxes over time: `python -m throng.view FILE.npy`.

Shows boxes coloured by their number of overlaps, pairs as lines, begun and ended pairs, the grid's
cells and their occupancy, stage times and counts as curves, the largest boxes and the densest cells
as lists. Needs Rerun: `pip install rerun-sdk`.
"""

from throng.view._frame import Frame, frames
from throng.view._record import record

__all__ = ["Frame", "frames", "record"]
