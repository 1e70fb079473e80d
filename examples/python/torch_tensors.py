"""Boxes in PyTorch tensors, and pairs that index them."""

# snippet-begin: torch
import torch
import throng

lower = torch.rand(1000, 3)
boxes = torch.cat([lower, lower + 0.1], dim=1)
pairs = throng.find_pairs(boxes, result="same", dtype="int64")  # torch indexes by int64
first, second = boxes[pairs[:, 0]], boxes[pairs[:, 1]]
# snippet-end: torch
assert len(pairs) > 0 and bool((first[:, 3:] >= second[:, :3]).all())
