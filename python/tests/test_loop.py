"""Records from a closed loop."""

import ctid
import numpy as np
import pandas as pd

TEXT = """model Plant
  parameter Real K = 1;
  parameter Real tau(unit="s", min=0) = 40;
  input Real u;
  output Real y = x;
  Real x(start=0);
equation
  tau*der(x) = K*u - x;
end Plant;
"""


def record(gain: float) -> pd.DataFrame:
    """K = 2, tau = 60 s, every second; with a gain of 0 the input is the reference."""
    draw = np.random.default_rng(3)
    x = integral = noise = 0.0
    rows = []
    for k in range(1500):
        reference = float((k // 45) * 7 % 5) - 2.0
        noise = 0.9 * noise + 0.05 * draw.standard_normal()
        y = x + noise
        integral += gain * (reference - y) / 60.0
        u = gain * (reference - y) + integral if gain else reference
        rows.append((float(k), u, y))
        decay = np.exp(-1.0 / 60.0)
        x = decay * x + (1.0 - decay) * 2.0 * u
    return pd.DataFrame(rows, columns=["t", "u", "y"]).set_index("t")


def level(gain: float) -> pd.DataFrame:
    """A tank of 154 cm^2 whose pump delivers 10 cm^3/s per volt; with a gain of 0 the command is a sequence of its own."""
    draw = np.random.default_rng(4)
    level, noise, integral = 16.0, 0.0, 5.0
    rows = []
    for k in range(1500):
        step = float((k // 45) * 7 % 5) - 2.0
        noise = 0.9 * noise + 0.05 * draw.standard_normal()
        y = level + noise
        integral += gain * (16.0 + step - y) / 100.0
        u = gain * (16.0 + step - y) + integral if gain else 5.0 + step
        rows.append((float(k), u, y))
        for _ in range(20):
            level += 0.05 * (10.0 * u - 12.5 * np.sqrt(level)) / 154.0
    return pd.DataFrame(rows, columns=["t", "u", "y"]).set_index("t")


def test_feedback_is_said() -> None:
    model = ctid.Model.from_text(TEXT)
    looped = model.fit(record(0.8)).summary()
    assert "warning: Feedback detected: u depends on the last 7 residuals" in looped
    assert "Feedback" not in model.fit(record(0.0)).summary()


def test_feedback_to_a_tank_is_said() -> None:
    tank = ctid.Model.tank("single-tank", known={"area": 154.0})
    looped = tank.fit(level(0.8), inputs=["u"], outputs=["y"]).summary()
    assert "warning: Feedback detected: the command depends on the last" in looped
    assert "Feedback" not in tank.fit(level(0.0), inputs=["u"], outputs=["y"]).summary()
