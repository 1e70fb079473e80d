"""Boxes over time, to look at: `python -m throng.view FILE.npy`.

Boxes coloured by how many others they overlap, pairs as lines, which began and which ended, the
grid's cells and how full they are, stage times and counts as curves, the largest boxes and the
densest cells as lists. Needs Rerun: `pip install rerun-sdk`.
"""

from throng.view._frame import Frame, frames
from throng.view._record import record

__all__ = ["Frame", "frames", "record"]
