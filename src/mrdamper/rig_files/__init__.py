"""Reading and writing: datasets, saved models, rig files."""
