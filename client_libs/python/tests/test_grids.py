"""Tests of cells as runs and arrays, and of poses. They need no server."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from hypermap_client import CellBox, CellPatch, CellRuns, GridGeometry, Pose
from hypermap_client._wire.observations import encode_spans


def runs_of(cells: dict[tuple[int, int], float], grid: GridGeometry) -> CellRuns:
    """Runs of one cell each, from values by row and column."""
    rows, cols = np.array(sorted(cells), np.int32).reshape(-1, 2).T
    values = np.array([cells[cell] for cell in sorted(cells)])
    return CellRuns(grid, rows, cols, cols + np.int32(1), values)


def test_runs_become_an_array() -> None:
    runs = CellRuns(
        GridGeometry(0.5),
        rows=np.array([-2, 0, 0], np.int32),
        col_begins=np.array([3, -1, 2], np.int32),
        col_ends=np.array([5, 1, 3], np.int32),
        values=np.array([1.0, np.nan, 2.0]),
    )
    assert (len(runs), runs.num_cells, runs.box) == (3, 5, CellBox(-2, 1, -1, 5))
    grid = runs.to_grid()
    nan = np.nan
    expected = [[nan, nan, nan, nan, 1, 1], [nan] * 6, [nan, nan, nan, 2, nan, nan]]
    np.testing.assert_array_equal(grid.values, expected)
    selected = [[0, 0, 0, 0, 1, 1], [0] * 6, [1, 1, 0, 1, 0, 0]]
    np.testing.assert_array_equal(grid.selected, np.array(selected, bool))
    assert grid.origin == Pose(-0.5, -1.0, 0.0)
    np.testing.assert_array_equal(runs.to_grid(CellBox(0, 1, 2, 4)).values, [[2, nan]])


def test_cells_of_random_runs_equal_those_of_a_loop() -> None:
    seed = random.randrange(1 << 32)
    generator = np.random.default_rng(seed)
    begins = generator.integers(-50, 50, 200, dtype=np.int32)
    runs = CellRuns(
        GridGeometry(1.0),
        np.sort(generator.integers(-20, 20, 200, dtype=np.int32)),
        begins,
        begins + generator.integers(1, 9, 200, dtype=np.int32),
        generator.random(200),
    )
    expected = [
        (row, col, value)
        for row, begin, end, value in zip(
            runs.rows, runs.col_begins, runs.col_ends, runs.values, strict=True
        )
        for col in range(begin, end)
    ]
    assert list(zip(*runs.cells(), strict=True)) == expected, f"seed {seed}"


def test_empty_runs_have_no_cells() -> None:
    empty = runs_of({}, GridGeometry(1.0))
    assert (len(empty), empty.num_cells, empty.box.shape) == (0, 0, (0, 0))
    assert empty.to_grid().values.shape == (0, 0)


def test_an_array_over_distant_cells_is_refused() -> None:
    far = runs_of({(0, 0): 1.0, (10**6, 10**6): 1.0}, GridGeometry(1.0))
    with pytest.raises(ValueError, match="max_cells"):
        far.to_grid()


def test_a_cell_is_half_open() -> None:
    grid = GridGeometry(0.5, Pose(1.0, 2.0, 0.0))
    assert grid.cell_at((1.0, 2.0)) == (0, 0)
    assert grid.cell_at((1.5, 2.0)) == (0, 1)
    assert grid.cell_at((0.9, 1.9)) == (-1, -1)


def test_a_rotated_grid() -> None:
    grid = GridGeometry(1.0, Pose(10.0, 0.0, math.pi / 2))
    # Columns count along the y axis of the map, rows against its x axis.
    np.testing.assert_allclose(grid.centres(2, 3), [7.5, 3.5])
    assert grid.cell_at((7.5, 3.5)) == (2, 3)
    x, y = runs_of({(2, 3): 1.0}, grid).to_grid().mesh()
    np.testing.assert_allclose(x, [[8, 8], [7, 7]])
    np.testing.assert_allclose(y, [[3, 4], [3, 4]])


def test_a_pose_and_its_inverse() -> None:
    pose = Pose(3.0, -2.0, 0.7)
    points = np.array([[0.0, 0.0], [1.5, -4.0], [1e3, 2e3]])
    np.testing.assert_allclose(pose.inverse().apply(pose.apply(points)), points, atol=1e-12)
    np.testing.assert_allclose(pose.inverse().matrix() @ pose.matrix(), np.eye(3), atol=1e-12)


def decode_spans(spans: np.ndarray) -> list[tuple[int, int]]:
    """Decodes spans as the comment of CellPatch.spans in observation.proto defines them."""
    cells, row, first = [], 0, 0
    for d_row, d_col, length in spans.reshape(-1, 3):
        row, first = row + d_row, first + d_col
        cells += [(row, col) for col in range(first, first + length)]
    return cells


def test_spans_encode_the_cells_of_a_patch() -> None:
    assert encode_spans(np.array([[2, 5], [2, 4], [-1, 7], [2, 9]])).tolist() == [
        -1, 7, 1, 3, -3, 2, 0, 5, 1,
    ]  # fmt: skip
    assert encode_spans(np.empty((0, 2))).tolist() == []
    seed = random.randrange(1 << 32)
    points = np.random.default_rng(seed).normal(0, 0.3, (500, 2))
    patch = CellPatch.from_points(points, 0.05)
    expected = {(math.floor(y / 0.05), math.floor(x / 0.05)) for x, y in points}
    assert decode_spans(encode_spans(patch.cells)) == sorted(expected), f"seed {seed}"
