"""From the tree of a file to tests: what the file itself states of its columns, clocks, groups and results."""
