"""Least squares, searches over a few nonlinear coordinates, parameter functions and scores."""
