"""Arguments of the calls: what they have to be, said by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ._ctid import ModelError

#: Largest seed.
LARGEST_SEED = 2**64 - 1


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """A whole number within limits."""
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and least <= value and (most is None or value <= most):
        return int(value)
    limits = f"of {least} or more" if most is None else f"from {least} to {most}"
    raise ModelError(f"{name} is {value!r}: give a whole number {limits}")


def number(name: str, value: Any) -> float:
    """A number."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ModelError(f"{name} is {value!r}: give a number, or leave it out") from None


def pair(name: str, value: Any, of: str) -> tuple[Any, Any]:
    """Two values; `of`: which."""
    if not isinstance(value, (str, bytes)):
        try:
            first, second = value
        except (TypeError, ValueError):
            pass
        else:
            return first, second
    raise ModelError(f"{name} is {value!r}: give a pair, {of}")


def by_name(name: str, given: Any) -> dict[str, Any]:
    """Values by name; none where nothing is given."""
    if given is None:
        return {}
    if not hasattr(given, "items"):
        raise ModelError(f"{name} is {given!r}: give values by name, {name}={{...}}")
    return {str(key): value for key, value in given.items()}


def numbers(name: str, given: Mapping[str, Any] | None) -> dict[str, float]:
    """Numbers by name."""
    return {key: number(f'{name}["{key}"]', value) for key, value in by_name(name, given).items()}


def pairs(name: str, given: Mapping[str, Any] | None, of: str) -> dict[str, tuple[float, float]]:
    """Two numbers by name; `of`: which."""
    result = {}
    for key, value in by_name(name, given).items():
        first, second = pair(f'{name}["{key}"]', value, of)
        result[key] = (number(f'{name}["{key}"]', first), number(f'{name}["{key}"]', second))
    return result
