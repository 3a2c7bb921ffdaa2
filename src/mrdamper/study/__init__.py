"""Ways from runs to a damper, tried in order and judged by omitted conditions."""
