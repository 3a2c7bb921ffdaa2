"""Bundled data: real tests of two MR dampers, with their licences."""
