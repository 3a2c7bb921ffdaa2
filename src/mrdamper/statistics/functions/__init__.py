"""Forms of parameter functions p(I, f, A), and fitting them; they know no model."""
