"""Forms of parameter functions p(I, f, A), and their fits, independent of models."""
