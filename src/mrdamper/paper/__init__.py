"""The method of Qian et al. 2024: identification, genetic search, functions, claims, tables and figures.

Nothing is imported here, so that an identification by the paper's method needs no plotting library.
"""
