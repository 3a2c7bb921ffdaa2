"""Motion and current in time: measured or synthetic, divided into strokes, equivalent sines."""

from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.made import random_motion, sine, sweep, triangle
from mrdamper.physics.motion.measured import measured_motion, smooth
from mrdamper.physics.motion.path import Path
from mrdamper.physics.motion.sines import (
    SINE_DISTORTION_LIMIT,
    STRAY_LIMIT,
    EquivalentSine,
    MotionAnalysis,
    analyse_motion,
    centred_motion,
    equivalent_sine,
)

__all__ = [
    "SINE_DISTORTION_LIMIT",
    "STRAY_LIMIT",
    "EquivalentSine",
    "Excitation",
    "MotionAnalysis",
    "Path",
    "analyse_motion",
    "centred_motion",
    "equivalent_sine",
    "measured_motion",
    "random_motion",
    "sine",
    "smooth",
    "sweep",
    "triangle",
]
