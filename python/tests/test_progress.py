"""The line with the present phase: where somebody sees it."""

from __future__ import annotations

import io
import sys
import time
from types import SimpleNamespace

import pytest
from conftest import MODELS

import ctid
from ctid._options import phases


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class ZMQInteractiveShell:
    """The shell of a notebook has this name."""


def notebook(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=ZMQInteractiveShell))
    return io.StringIO()


def terminal(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    return Terminal()


def shown(text: str) -> str:
    """What is left on the line."""
    line = ""
    for part in text.split("\r"):
        line = part + line[len(part) :]
    return line


@pytest.mark.parametrize("where", [terminal, notebook])
def test_a_phase_is_written_with_the_time(monkeypatch, block, where):
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0})
    stream = where(monkeypatch)
    monkeypatch.setattr(sys, "stderr", stream)
    fit.diagnose(effort="quick")
    text = stream.getvalue()
    assert "\rfitting the model ... 0 of 5 s" in text and "\n" not in text
    assert shown(text).strip() == ""
    before = len(text)
    fit.diagnose(effort="quick", time_limit=2.5)
    assert " of 2.5 s" in stream.getvalue()[before:]
    before = len(stream.getvalue())
    fit.diagnose(effort="quick", progress=False)
    assert len(stream.getvalue()) == before


def test_the_time_goes_on_within_a_phase(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with phases(True) as tell:
        assert tell is not None
        tell("a long phase")
        deadline = time.monotonic() + 30.0
        while "a long phase ... 1 s" not in stream.getvalue() and time.monotonic() < deadline:
            time.sleep(0.05)
        tell("end")
        assert "a long phase ... 1 s" in stream.getvalue() and shown(stream.getvalue()).startswith("end ... ")
    assert shown(stream.getvalue()).strip() == ""


def test_nothing_is_written_to_a_file(monkeypatch, block):
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0})
    stream = io.StringIO()
    for nobody in (stream, None):
        monkeypatch.setattr(sys, "stderr", nobody)
        fit.diagnose(effort="quick")
    # A terminal with IPython is no notebook.
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))
    monkeypatch.setattr(sys, "stderr", stream)
    fit.diagnose(effort="quick")
    assert stream.getvalue() == ""
