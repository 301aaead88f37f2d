"""Pages, where plotly is installed: they hold the plotly.js of its package."""

from __future__ import annotations

import base64
import gzip
import os
from collections.abc import Callable
from functools import cache
from importlib import import_module

from . import _ctid


@cache
def _plotly() -> str:
    """plotly.js as a page holds it: gzipped, in base64."""
    try:
        offline = import_module("plotly.offline")
    except ImportError:
        raise ImportError("a report needs plotly: pip install plotly") from None
    script: str = offline.get_plotlyjs()
    return base64.b64encode(gzip.compress(script.encode(), mtime=0)).decode("ascii")


def write_page(path: str | os.PathLike[str], page: Callable[[], str]) -> None:
    """Writes a page with plotly.js in it. What stands at the path is left alone where plotly is missing."""
    plotly = _plotly()
    whole = _ctid.with_plotly(page(), plotly)
    with open(path, "w", encoding="utf-8") as file:
        file.write(whole)
