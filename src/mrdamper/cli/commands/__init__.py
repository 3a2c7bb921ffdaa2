"""One command per module, on its `app`. Heavy imports stay inside the functions."""
