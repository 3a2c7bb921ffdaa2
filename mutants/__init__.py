"""Planted faults (mutants): tests of the tests."""
