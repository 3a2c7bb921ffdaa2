"""Figures: they take results and return a matplotlib Figure."""
