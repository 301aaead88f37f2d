"""A tank whose effect is found: the bundled record, the program's tour in Python.

Writes tank-fit.png, tank-diagnosis.png and tank.html into the folder that is named, or here.
"""

# %% A record is a frame whose index is the time.
import os
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import pandas as pd

import ctid

root = Path(os.environ.get("CTID_ROOT", Path(__file__).resolve().parents[2]))
records = root / "examples" / "records"
folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
df = pd.read_csv(records / "tour.csv", index_col="t [s]")
test = pd.read_csv(records / "tour-test.csv", index_col="t [s]")

# %% What we believe: S dH/dt = pump_gain u - alpha sqrt(H). The area is measured with a tape.
model = ctid.Model.tank("single-tank", known={"area": 154.0})
fit = model.fit(df, inputs=["u"], outputs=["y"])
print(fit.summary())
print(f"on the test record: {fit.score(test):.1f} %")

# %% Where does it fail?
print(fit.failures().head())
print("\n".join(fit.failures_in_words()))
axes = fit.plot()
axes[0].figure.savefig(folder / "tank-fit.png", dpi=100)

# %% What is missing?
d = fit.diagnose(test=test)
print(d.summary())
print(d.ladder)
print(d.ranking.head())
axes = d.plot()
axes[0].figure.savefig(folder / "tank-diagnosis.png", dpi=100)
d.report(folder / "tank.html")

# %% The model with the effect in it.
better = d.model.fit(df, inputs=["u"], outputs=["y"])
print(better.summary())
print(f"on the test record: {better.score(test):.1f} %")
assert d.effects == ["overflow"] and better.score(test) > 98.0
