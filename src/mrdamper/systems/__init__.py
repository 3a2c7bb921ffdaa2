"""Simulation of dampers in vehicles and buildings: structures, inputs and controllers."""
