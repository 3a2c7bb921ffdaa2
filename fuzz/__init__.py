"""Fuzz targets: what comes from outside may be refused, but never surprise."""
