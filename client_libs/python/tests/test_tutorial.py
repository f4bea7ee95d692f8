"""Tests that run the tutorial as a script."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import matplotlib.image
from server import DEADLINE_S, ROOT, Server

TUTORIAL = ROOT / "client_libs" / "python" / "examples" / "tutorial.py"


def run(server: Server, plot: pathlib.Path) -> str:
    command = [sys.executable, TUTORIAL, "--server", server.address, "--plot", plot]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=2 * DEADLINE_S
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    return done.stdout


def test_the_tutorial_runs_twice_and_writes_a_picture(
    server: Server, tmp_path: pathlib.Path
) -> None:
    first, again = (run(server, tmp_path / name) for name in ("first.png", "again.png"))
    assert "in the dining corner: ['chair', 'chair', 'chair', 'chair', 'cup', 'table']" in first
    assert "chair      4 in objects; 1 in outside" in first
    assert "up to 0.1 m from (3.0, 2.55): ['lane']" in first
    assert "objects up to 0.6 m from the lane: ['bed', 'chair']" in first
    assert "the sofa has moved by 1.70 m" in first
    assert first.replace("first.png", "again.png") == again
    picture = matplotlib.image.imread(tmp_path / "again.png")
    assert picture.shape[0] > 400 and picture.shape[1] > 1000
    # The picture has dark walls on white paper, and colours.
    assert picture[..., :3].min() < 0.2 and picture[..., :3].std() > 0.1


def test_the_tutorial_runs_without_geopandas(server: Server, tmp_path: pathlib.Path) -> None:
    code = (
        "import runpy, sys; sys.modules['geopandas'] = None; "
        f"sys.argv = ['tutorial.py', '--server', {server.address!r}, '--map', 'plain', "
        f"'--plot', {str(tmp_path / 'plain.png')!r}]; runpy.run_path({str(TUTORIAL)!r})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False,
        timeout=2 * DEADLINE_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "hypermap-client[geopandas]" in done.stdout
    assert (tmp_path / "plain.png").stat().st_size > 10_000
