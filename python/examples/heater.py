"""A heater of one's own, as text: fitted, its missing effect found, simulated, linearised and written down.

Writes heater-fit.png, heater-diagnosis.png, heater-band.png and heater.mo into the folder that is named, or here.
"""

# %% The physics in a few lines.
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np
import pandas as pd
from matplotlib import pyplot

import ctid

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
model = ctid.Model.from_text("""
model Heater "a block with a heater, in a room"
  parameter Real C(unit="J/K", min=0) = 50 "heat capacity";
  parameter Real k(unit="W/K", min=0) = 0.1 "loss to the room";
  parameter Real g(unit="W", min=0) = 0.2 "heater, per percent";
  input Real u(unit="%") "power of the heater";
  input Real Ta(unit="degC") "room";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
equation
  C*der(T) = g*u - k*(T - Ta);
end Heater;
""")

# %% A record. The sensor sits in a pocket and lags by 40 s, which the model does not know.
rng = np.random.default_rng(3)
block = sensor = 20.0
rows = []
for row in range(600):
    u = 20.0 + 60.0 * (np.sin(0.02 * row) + np.sin(0.11 * row) > 0.0)
    rows.append((5.0 * row, u, 20.0, sensor + 0.05 * rng.standard_normal()))
    for _ in range(50):
        block += 0.1 / 52.0 * (0.12 * u - 0.17 * (block - 20.0))
        sensor += 0.1 / 40.0 * (block - sensor)
whole = pd.DataFrame(rows, columns=["t [s]", "u", "Ta", "y"]).set_index("t [s]")
df, test = whole.iloc[:400], whole.iloc[400:]

# %% Fitted: the heat capacity follows from the mass.
fit = model.fit(df, known={"C": 52.0})
print(fit.summary())
fit.plot()[0].figure.savefig(folder / "heater-fit.png", dpi=100)

# %% What is missing?
d = fit.diagnose(test=test)
print(d.summary())
print(d.ladder)
d.plot()[0].figure.savefig(folder / "heater-diagnosis.png", dpi=100)

# %% The mended model: on the test record with a band, as matrices, as text.
mended = d.model.fit(df, known={"C": 52.0})
band = mended.simulate(test, interval=0.95)
_, ax = pyplot.subplots(figsize=(8.0, 3.0), layout="constrained")
ax.fill_between(band.index, band["y", "reading lower"], band["y", "reading upper"], alpha=0.3, label="95 % of readings")
ax.plot(band.index, band["y", "mean"], label="model")
ax.plot(test.index, test["y"], ".", ms=2, color="0.4", label="measured")
ax.set_xlabel("time [s]")
ax.set_ylabel("y [degC]")
ax.legend()
ax.figure.savefig(folder / "heater-band.png", dpi=100)
print(f"on the test record: {fit.score(test):.1f} %, mended {mended.score(test):.1f} %")
print("time constants [s]:", np.sort(-1.0 / mended.model.linearize().poles.real))
(folder / "heater.mo").write_text(mended.to_modelica(), encoding="utf-8")
assert any("lag(" in effect for group in d.groups for effect in group) and mended.score(test) > 90.0
