"""Bars: on terminals only, after a second, the outermost alone."""

import os
import pty
import subprocess
import sys

import pytest

from cdsm.support import progress
from cdsm.support.progress import progress_allowed, progress_bar, track
from tests.support.patience import HANGS
from tests.support.processes import ROOT

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # which rich takes for a terminal
    monkeypatch.setattr(progress, "DELAY", 0.0)


def test_a_pipe_shows_nothing(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(progress, "DELAY", 0.0)
    assert list(track([1, 2, 3], "counting")) == [1, 2, 3]
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("terminal")
def test_a_terminal_shows_what_is_done_and_how_much_is_left(capsys: Capture) -> None:
    with progress_bar("sweep", 1000, 400, rate=True) as advance:
        advance(600)
    shown = capsys.readouterr().err
    assert "sweep" in shown
    assert "1000/1000" in shown
    with progress_bar("fitting"):
        pass
    assert "fitting" in capsys.readouterr().err


@pytest.mark.usefixtures("terminal")
def test_a_bar_inside_another_and_one_that_is_not_wanted_are_not_shown(capsys: Capture) -> None:
    with progress_bar("outer", 1), progress_bar("inner", 1) as advance:
        advance(1)
    shown = capsys.readouterr().err
    assert "outer" in shown
    assert "inner" not in shown
    with progress_bar("unwanted", 1, wanted=False):
        assert list(track([1], "inner")) == [1]
    with progress_allowed(False):
        assert list(track([1], "forbidden")) == [1]
    assert capsys.readouterr().err == ""
    assert list(track([1], "afterwards")) == [1]
    assert "afterwards" in capsys.readouterr().err


@pytest.mark.usefixtures("terminal")
def test_short_work_shows_nothing(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.setattr(progress, "DELAY", 60.0)
    assert list(track([1], "short")) == [1]
    assert capsys.readouterr().err == ""


WORK = """
import time
from cdsm.support import progress
progress.DELAY = 0.05
for _ in progress.track(range(4), "working"):
    time.sleep(0.1)
"""


def test_a_real_terminal_shows_long_work() -> None:
    ours, theirs = pty.openpty()
    subprocess.run([sys.executable, "-c", WORK], stderr=theirs, cwd=ROOT, timeout=HANGS, check=True)
    os.close(theirs)
    assert b"working" in os.read(ours, 10_000)
    os.close(ours)
