"""From rough boards and photographs to exact outlines (paper, Joint Image-Based Segmentation)."""

from kerfwright.refine.segment.boards import segment_boards
from kerfwright.refine.segment.options import BoardOutlines, SegmentOptions

__all__ = ["BoardOutlines", "SegmentOptions", "segment_boards"]
