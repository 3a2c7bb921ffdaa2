"""Procedures that identify a damper from runs, compared by cross-validation over conditions."""
