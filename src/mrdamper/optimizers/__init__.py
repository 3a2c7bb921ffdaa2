"""Searches over a few nonlinear coordinates."""
