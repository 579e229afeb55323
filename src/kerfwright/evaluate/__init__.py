"""How far a model is from the truth, board by board and contact by contact."""

from kerfwright.evaluate.score import evaluate, evaluate_model
from kerfwright.evaluate.truth import Truth, read_truth

__all__ = ["Truth", "evaluate", "evaluate_model", "read_truth"]
