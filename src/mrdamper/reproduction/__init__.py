"""The study of Qian et al. 2024, reproduced on the virtual rig or run on a dataset."""

from mrdamper.reproduction.study import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
