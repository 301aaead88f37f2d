"""The bundled records and models, and the program where it is built."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

ROOT = Path(os.environ.get("CTID_ROOT", Path(__file__).resolve().parents[2]))
MODELS = ROOT / "examples" / "models"
RECORDS = ROOT / "examples" / "records"

#: pandas before 3.1 reads some numbers to the last digit but one unless it is told to; since then it is deprecated to tell it.
EXACT = {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}


def read_csv(path: Path, **options: Any) -> pd.DataFrame:
    """A file with its numbers to the last digit."""
    return pd.read_csv(path, **EXACT, **options)


@pytest.fixture
def block() -> pd.DataFrame:
    """A heated block with a sensor that lags."""
    frame = read_csv(MODELS / "heated-block.csv", index_col="t [s]")
    return frame.rename(columns={"heater [%]": "u [%]", "room [degC]": "Ta [degC]", "block [degC]": "y [degC]"})


@pytest.fixture
def tour() -> pd.DataFrame:
    """A tank that overflows."""
    return read_csv(RECORDS / "tour.csv", index_col="t [s]")


@pytest.fixture
def tour_test() -> pd.DataFrame:
    """The same tank on another day."""
    return read_csv(RECORDS / "tour-test.csv", index_col="t [s]")


@pytest.fixture
def program() -> str:
    """The program `ctid`."""
    named = os.environ.get("CTID_PROGRAM") or shutil.which("ctid")
    if named is None:
        pytest.skip("the program ctid is not built: name it in CTID_PROGRAM")
    return named
