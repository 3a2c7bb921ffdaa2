"""Delimited text as machines write it: encoding, form, numbers, blocks."""
