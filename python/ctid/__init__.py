"""Continuous-time identification, and which physical effect a model of measured data is missing.

>>> import ctid, pandas as pd
>>> df = pd.read_csv("rig.csv", index_col="t")
>>> fit = ctid.Model.from_file("block.mo").fit(df, inputs=["u", "Ta"], outputs=["y"], known={"C": 52.0})
>>> print(fit.summary())
>>> d = fit.diagnose()
>>> d.verdict, d.effects

A record is a pandas frame whose index is the time, or a mapping of arrays with the time under "t". NaN is a missing reading. A list of records
are several experiments. Results are frames where pandas is installed; else mappings of arrays.
"""

from . import tables
from ._ctid import ContinuousRls, DataError, Error, ModelError, StabilizedOe
from ._design import Design
from ._diagnosis import Diagnosis
from ._fit import Fit
from ._linear import Fcloe, Identification, StateSpace, identify
from ._model import Model
from ._monitor import Monitor, RowResult

__all__ = [
    "ContinuousRls",
    "DataError",
    "Design",
    "Diagnosis",
    "Error",
    "Fcloe",
    "Fit",
    "Identification",
    "Model",
    "ModelError",
    "Monitor",
    "RowResult",
    "StabilizedOe",
    "StateSpace",
    "identify",
    "tables",
]
