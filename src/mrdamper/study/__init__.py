"""Ways from runs to a damper, tried in order and judged by cross-validation over conditions."""
