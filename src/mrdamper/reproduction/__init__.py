"""The study of Qian et al. 2024, reproduced on the virtual rig or run on a dataset."""

from mrdamper.reproduction.found import Reproduction
from mrdamper.reproduction.study import reproduce

__all__ = ["Reproduction", "reproduce"]
