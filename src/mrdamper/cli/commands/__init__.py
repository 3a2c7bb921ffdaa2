"""One command per module; `register(app)` adds it. Heavy imports stay inside the functions."""
