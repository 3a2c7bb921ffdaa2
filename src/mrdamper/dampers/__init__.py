"""Identified dampers: what each kind can do, and how it comes from runs."""
