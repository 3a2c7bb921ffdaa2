"""One command a module: `register(app)` adds it. Heavy imports stay inside the functions."""
