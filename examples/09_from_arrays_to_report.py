"""
From arrays to a report
=======================

Records that are already arrays need no files: build runs, study them and write the report."""

# %%
# A run holds time [s], displacement [m] and force [N], the current [A] and the steady window [s].
import tempfile
from pathlib import Path

from mrdamper import Condition, Dataset, Run, load_dataset, run_study

tests = load_dataset().rig("utfsm")  # stands for arrays of your own
runs = [
    Run(
        id=test.id,
        rig="utfsm",
        time=test.time,
        displacement=test.displacement,
        force=test.force,
        current=test.current_A,
        window=test.window,
        split=test.split,
    )
    for test in tests
    if test.excitation == "sine"
]
dataset = Dataset(tuple(runs), "arrays")
print(dataset)

# %%
# A study selects the model and states its errors and limitations.
study = run_study(dataset)
print(study)

# %%
# A prediction is a table of samples for the library of your choice.
prediction = study.model.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
print(prediction.to_polars().head(3))  # or to_pandas()

# %%
# The report with its head, the model file, the tables and the figures.
folder = Path(tempfile.mkdtemp())
written = study.write_report(folder, about={"customer": "Example Ltd", "type": "damper 7"})
print(f"{len(written)} files, the first of them {written[0].name}")
