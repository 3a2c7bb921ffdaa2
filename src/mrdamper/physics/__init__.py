"""Motions, the gas spring, hysteresis, integration in time, and simulation of a model on a motion."""
