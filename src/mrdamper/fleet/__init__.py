"""The same study over thousands of dampers, on one machine or on a cluster: `line.run_fleet`."""
