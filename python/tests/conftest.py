"""The bundled records and models, and the program where it is built."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(os.environ.get("CTID_ROOT", Path(__file__).resolve().parents[2]))
MODELS = ROOT / "examples" / "models"
RECORDS = ROOT / "examples" / "records"


@pytest.fixture
def block() -> pd.DataFrame:
    """A heated block with a sensor that lags."""
    frame = pd.read_csv(MODELS / "heated-block.csv", index_col="t [s]", float_precision="round_trip")
    return frame.rename(columns={"heater [%]": "u [%]", "room [degC]": "Ta [degC]", "block [degC]": "y [degC]"})


@pytest.fixture
def tour() -> pd.DataFrame:
    """A tank that overflows."""
    return pd.read_csv(RECORDS / "tour.csv", index_col="t [s]", float_precision="round_trip")


@pytest.fixture
def tour_test() -> pd.DataFrame:
    """The same tank on another day."""
    return pd.read_csv(RECORDS / "tour-test.csv", index_col="t [s]", float_precision="round_trip")


@pytest.fixture
def program() -> str:
    """The program `ctid`."""
    named = os.environ.get("CTID_PROGRAM") or shutil.which("ctid")
    if named is None:
        pytest.skip("the program ctid is not built: name it in CTID_PROGRAM")
    return named
