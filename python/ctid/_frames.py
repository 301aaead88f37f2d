"""Frames of measured data in, frames of results out. Without pandas: mappings of arrays."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from ._ctid import DataError, Frame

if TYPE_CHECKING:
    import pandas as pd

Array: TypeAlias = npt.NDArray[np.float64]
#: One record: a frame whose index is the time, or a mapping of arrays with one that holds the time.
Data: TypeAlias = "pd.DataFrame | Mapping[str, npt.ArrayLike]"
#: One record or several experiments.
Records: TypeAlias = "Data | Sequence[Data]"

#: Instants, and their name.
Index: TypeAlias = tuple[Any, Any]

#: Keys of a mapping under which the time is looked for, in this order.
TIMES = ("t", "time", "Time", "T")


def pandas() -> Any:
    """The module pandas, or None where it is not installed."""
    try:
        import pandas
    except ImportError:
        return None
    return pandas


def is_frame(data: object) -> bool:
    module = pandas()
    return module is not None and isinstance(data, module.DataFrame)


def as_list(data: Records | None, what: str = "data") -> list[Data]:
    """Records as a list."""
    if data is None:
        return []
    if isinstance(data, Mapping) or is_frame(data):
        return [cast("Data", data)]
    if isinstance(data, Sequence) and not isinstance(data, (str, bytes)):
        return list(data)
    raise DataError(
        f"{what}: a {type(data).__name__} is not a record: give a pandas frame whose index is the time, a mapping of arrays, or a list of them"
    )


def _numbers(name: str, column: str, values: Any) -> Array:
    """One column as numbers, NaN where a reading is missing."""
    dtype = getattr(values, "dtype", None)
    kind = getattr(dtype, "kind", None)
    if hasattr(values, "to_numpy") and kind in ("f", "i", "u", "b"):
        # The nullable types of pandas too.
        array = values.to_numpy(dtype=np.float64, na_value=np.nan)
    else:
        try:
            array = np.asarray(values)
        except ValueError as error:
            raise DataError(f'{name}, column "{column}": {error}: give one number for each instant') from None
    if array.ndim != 1:
        shape = " by ".join(str(n) for n in array.shape) or "one number"
        raise DataError(f'{name}, column "{column}": it is {shape}: give one number for each instant')
    if array.dtype.kind not in "fiub":
        for row, value in enumerate(array.tolist()):
            if not isinstance(value, (int, float)):
                raise DataError(
                    f'{name}, row {row + 2}, column "{column}": {value!r} is not a number: '
                    f'make it one, pd.to_numeric(df["{column}"], errors="coerce") makes such readings missing'
                )
        raise DataError(
            f'{name}, column "{column}": it holds objects of Python: convert it, df["{column}"].astype(float)'
        )
    return np.ascontiguousarray(array, dtype=np.float64)


def _time(name: str, header: str, values: Any) -> Array | list[str]:
    """The time as numbers, or as dates in text form."""
    module = pandas()
    if module is not None and isinstance(values, module.MultiIndex):
        raise DataError(f"{name}: the index has several levels: the time alone has to be the index, one frame for each experiment")
    if module is not None and isinstance(values, module.DatetimeIndex) and values.tz is not None:
        raise DataError(
            f'{name}, column "{header}": its dates have the time zone {values.tz}: '
            'take it off, df.index = df.index.tz_convert("UTC").tz_localize(None)'
        )
    if module is not None and isinstance(values, module.TimedeltaIndex):
        raise DataError(
            f'{name}, column "{header}": it holds durations: make seconds of them, df.index = df.index.total_seconds()'
        )
    if module is not None and isinstance(values, module.PeriodIndex):
        raise DataError(f'{name}, column "{header}": it holds periods: make dates of them, df.index = df.index.to_timestamp()')
    array = np.asarray(values)
    if array.dtype.kind == "M":
        if np.isnat(array).any():
            row = int(np.flatnonzero(np.isnat(array))[0])
            raise DataError(f'{name}, row {row + 2}, column "{header}": the date is missing: leave the row out')
        return cast("list[str]", np.datetime_as_string(array.astype("datetime64[ns]"), unit="ns").tolist())
    return _numbers(name, header, array)


def _sorted(name: str, header: str, time: Array | list[str]) -> None:
    """Refuses instants that do not rise, with the mend of a frame."""
    values: Any = time if isinstance(time, np.ndarray) else np.array(time, dtype="datetime64[ns]")
    if isinstance(time, np.ndarray) and np.isnan(time).any():
        row = int(np.flatnonzero(np.isnan(time))[0])
        raise DataError(f'{name}, row {row + 2}, column "{header}": the time is missing: leave the row out')
    back = np.flatnonzero(values[1:] < values[:-1])
    if back.size:
        row = int(back[0]) + 1
        raise DataError(
            f'{name}, row {row + 2}, column "{header}": the time goes back from {values[row - 1]} to {values[row]}: '
            "sort it, df.sort_index(), or give a list of frames where these are several experiments"
        )


def _time_key(columns: Iterable[str], wanted: Sequence[str]) -> str | None:
    """The column of a mapping that holds the time; None where there is none. `wanted`: the columns that the model reads."""
    names = [c for c in columns if c not in wanted]
    found = [c for c in TIMES if c in names] + [c for c in names if c.split(" [")[0] in TIMES]
    return found[0] if found else None


def to_frame(data: Data, name: str, wanted: Sequence[str], others: Sequence[str] = ()) -> Frame:
    """A record for the native part. Row 1 in messages is the header, as in a file. `wanted`: the columns that the model reads; `others`: those that a
    record may have."""
    columns: dict[str, Any]
    if is_frame(data):
        table = cast("pd.DataFrame", data)
        if not table.columns.is_unique:
            twice = [str(c) for c in table.columns[table.columns.duplicated()]]
            raise DataError(f'{name}: there are two columns "{twice[0]}": name them apart')
        if table.columns.nlevels > 1:
            raise DataError(f"{name}: the columns have several levels: one name for each column is needed")
        columns = {str(c): table[c] for c in table.columns}
        header = "t" if table.index.name is None else str(table.index.name)
        times: Any = table.index
        if isinstance(times, pandas().RangeIndex) and table.index.name is None:
            named = [c for c in columns if c.split(" ")[0].split("[")[0] in TIMES]
            if named and not any(c in wanted for c in named):
                raise DataError(
                    f'{name}: the index counts rows, and there is a column "{named[0]}": make it the index, df.set_index("{named[0]}")'
                )
            warnings.warn(
                f'{name}: the index counts rows, and is read as seconds: make the time the index, or name it, df.index.name = "t [s]"',
                stacklevel=4,
            )
    else:
        if not isinstance(data, Mapping):
            as_list(cast("Records", data), name)
        columns = {str(c): v for c, v in cast("Mapping[str, npt.ArrayLike]", data).items()}
        found = _time_key(columns, wanted)
        if found is None:
            raise DataError(f'{name}: there is no time: give its instants under "t"')
        header = found
        times = columns.pop(header)
    time = _time(name, header, times)
    _sorted(name, header, time)
    headers: list[str] = []
    values: list[Array] = []
    for column, cells in columns.items():
        if column == header:
            continue
        if any(name in (*wanted, *others) for name in (column, column.split(" [")[0])):
            headers.append(column)
            values.append(_numbers(name, column, cells))
    for column in wanted:
        if column not in headers and not any(h.split(" [")[0] == column for h in headers):
            has = ", ".join(columns) or "none"
            raise DataError(f'{name}: there is no column "{column}"; it has {has}: say which it is, inputs=[...], outputs=[...]')
    return Frame(name, header, time, headers, values)


def to_frames(data: Records | None, name: str, wanted: Sequence[str], others: Sequence[str] = ()) -> list[Frame]:
    """Records for the native part."""
    records = as_list(data, name)
    frames = []
    # No comprehension: of some versions of Python it is a further frame on the stack, from which warnings name the caller.
    for k, record in enumerate(records):
        frames.append(to_frame(record, name if len(records) == 1 else f"{name} {k + 1}", wanted, others))
    return frames


def columns_in(data: Data, wanted: Sequence[str]) -> list[str]:
    """Those of the columns that a record has, with their unit or without."""
    names = [str(name) for name in data] if isinstance(data, Mapping) or is_frame(data) else []
    return [c for c in wanted if any(c in (name, name.split(" [")[0]) for name in names)]


def to_one_frame(data: Data, name: str, wanted: Sequence[str]) -> Frame:
    """The only record of a call for the native part."""
    records = as_list(data, name)
    if len(records) != 1 or records[0] is not data:
        raise DataError(f"{name}: one record is needed, and a {type(data).__name__} is given: call it once for each")
    return to_frame(data, name, wanted)


def index_of(data: Data, rows: int, wanted: Sequence[str]) -> Index | None:
    """The instants of a record and their name, where it has so many rows. `wanted`: the columns that the model reads."""
    if is_frame(data):
        index = cast("pd.DataFrame", data).index
        return (index.name, index) if len(index) == rows else None
    columns = {str(c): v for c, v in cast("Mapping[str, npt.ArrayLike]", data).items()}
    key = _time_key(columns, wanted)
    if key is None:
        return None
    times = np.asarray(columns[key])
    return (key, times) if times.size == rows else None


def table(columns: Mapping[Any, Any], index: Any = None, name: str | None = None) -> Any:
    """A frame where pandas is installed; else a dict of arrays, of which the first is the index. `name`: that of the index."""
    module = pandas()
    if module is not None:
        return module.DataFrame(dict(columns), index=None if index is None else module.Index(index, name=name))
    arrays = {key: np.asarray(values) for key, values in columns.items()}
    return arrays if index is None else {name: np.asarray(index), **arrays}


def stacked(parts: Sequence[tuple[str, Index, Mapping[str, Array]]]) -> Any:
    """Tables of several records, each with its name, index and columns, below each other."""
    module = pandas()
    if module is not None:
        frames = [table(columns, index, name) for _, (name, index), columns in parts]
        return module.concat(frames, keys=[record for record, _, _ in parts], names=["record"])
    records = np.repeat([record for record, _, _ in parts], [len(index) for _, (_, index), _ in parts])
    name = parts[0][1][0]
    whole = {"record": records, name: np.concatenate([index for _, (_, index), _ in parts])}
    return whole | {output: np.concatenate([columns[output] for _, _, columns in parts]) for output in parts[0][2]}


def series(names: Sequence[str], values: Sequence[float | None], name: str) -> Any:
    """A series where pandas is installed; else a dict."""
    numbers = [np.nan if value is None else float(value) for value in values]
    module = pandas()
    if module is None:
        return dict(zip(names, numbers, strict=True))
    return module.Series(numbers, index=list(names), name=name, dtype=np.float64)


def row_count(data: Data) -> int:
    """Number of rows of a record."""
    if isinstance(data, Mapping):
        return max((np.asarray(values).size for values in data.values()), default=0)
    return len(data)


def band_table(outputs: Iterable[tuple[str, Mapping[str, Array]]], data: Data, interval: float | None, wanted: Sequence[str]) -> pd.DataFrame:
    """Simulated outputs as a table with the index of the data. Columns of each output: `mean`, and with an interval its bounds `lower`, `upper`."""
    columns: dict[Any, Array] = {}
    for output, band in outputs:
        for name, values in band.items():
            if interval is not None or name == "mean":
                columns[output, name] = values
    rows = next(iter(columns.values())).size
    header, index = index_of(data, rows, wanted) or (None, None)
    result: pd.DataFrame = table(columns, index, header)
    return result
