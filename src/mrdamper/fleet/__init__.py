"""Identification of thousands of dampers, on one machine or on a cluster: `run.run_fleet`."""
