"""Dampers at work: vehicles and buildings, what shakes them, and the laws that set the current."""
