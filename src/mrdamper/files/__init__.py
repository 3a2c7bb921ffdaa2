"""Datasets, saved models and motions on disk; a file or folder appears whole or not at all."""
