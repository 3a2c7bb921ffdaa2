"""Files as a rig writes them."""

import numpy as np


def csv_of(run, header="Time (s),Displacement (mm),Force (N)"):
    """A run as a rig's file."""
    table = np.column_stack([run.time, 1e3 * run.displacement, run.force])
    lines = "\n".join(f"{t:.6f},{x:.6f},{f:.4f}" for t, x, f in table.tolist())
    return f"{header}\n{lines}\n".encode()
