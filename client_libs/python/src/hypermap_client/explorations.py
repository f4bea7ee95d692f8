"""Explorations of an area by several robots. Positions are in metres in the frame of the call."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum

import shapely


class ExplorationState(IntEnum):
    """Whether an exploration is running."""

    ACTIVE = 1
    """Robots can claim goals."""
    ENDED = 2
    """The exploration has ended; no goals are given any more."""


class EndReason(IntEnum):
    """The reason why an exploration has ended."""

    NONE = 0
    """The exploration has not ended."""
    DONE = 1
    """All floor is explored, except for remainders smaller than min_gain_cells."""
    ONLY_UNREACHABLE_LEFT = 2
    """No place that robots can reach has a view of the remaining floor."""
    STOPPED = 3
    """A client stopped the exploration."""


class GoalOutcome(IntEnum):
    """The result of a robot's attempt to reach its goal."""

    REACHED = 1
    """The robot has observed the surroundings, and its observations are acknowledged."""
    UNREACHABLE = 2
    """The robot cannot reach the goal. No robot is sent there until the floor nearby changes."""
    ABANDONED = 3
    """The robot gave the goal up. It can be assigned to other robots."""


@dataclass(frozen=True, slots=True)
class Goal:
    """A viewpoint that is leased to a robot.

    id: id of its object on the layer "explorations".
    gain_cells: number of unexplored floor cells that were visible from the position when the goal
        was claimed.
    path_length_m: length in metres of the path from the pose of the robot in its claim.
    expire_time: end of the lease, in UTC.
    """

    id: int
    robot: str
    position: shapely.Point
    gain_cells: int
    path_length_m: float
    expire_time: datetime


@dataclass(frozen=True, slots=True)
class UnreachablePlace:
    """A goal that a robot reported as unreachable.

    id: id of its object on the layer "explorations".
    """

    id: int
    robot: str
    position: shapely.Point


@dataclass(frozen=True, slots=True)
class Exploration:
    """An area that robots explore, with the state of the exploration.

    id: id of its object on the layer "explorations".
    occupancy_layer: layer that tells which cells are floor.
    exploration_layer: layer that tells which cells are explored.
    robot_radius_m: clearance in metres that paths keep to cells that are not free.
    range_m: range of the robots' sensors in metres.
    min_gain_cells: viewpoints that would reveal fewer cells are not assigned.
    start_time, end_time: in UTC; end_time is None while the exploration is active.
    goals: the goals that are leased to robots at present.
    """

    id: int
    state: ExplorationState
    end_reason: EndReason
    area: shapely.Polygon
    occupancy_layer: str
    exploration_layer: str
    robot_radius_m: float
    range_m: float
    min_gain_cells: int
    start_time: datetime
    end_time: datetime | None
    goals: tuple[Goal, ...]
    unreachable_places: tuple[UnreachablePlace, ...]


@dataclass(frozen=True, slots=True)
class ExplorationProgress:
    """The explored and the remaining part of the floor of an area, in cells of the occupancy layer.

    reachable_cells: unexplored cells that are visible from a place that robots can reach.
    unreachable_cells: all other unexplored cells, and those that stayed unexplored although robots
        looked at them twice.
    fraction: explored / (explored + reachable), in [0, 1]; 1 if both are zero.
    rate_m2_per_s: area explored in the last minute, in square metres per second.
    cell_area_m2: area of a cell in square metres.
    """

    explored_cells: int
    reachable_cells: int
    unreachable_cells: int
    fraction: float
    rate_m2_per_s: float
    cell_area_m2: float


@dataclass(frozen=True, slots=True)
class ExplorationAnswer:
    """An exploration at a revision.

    frame_id: frame of all positions; empty for the map's own.
    progress: set by get_exploration only.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    revision: int
    frame_id: str
    exploration: Exploration
    progress: ExplorationProgress | None = None
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class ExplorationList:
    """All explorations of a map at a revision, the newest first.

    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    revision: int
    frame_id: str
    explorations: tuple[Exploration, ...]
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class Frontier:
    """A connected set of unexplored floor cells that border explored floor.

    num_cells: number of its cells.
    viewpoint: a place that a robot can reach and that has a view of the frontier; None if there is
        no such place.
    gain_cells: number of unexplored floor cells visible from the viewpoint.
    cells: centres of its cells, if the call asked for them, else empty.
    """

    num_cells: int
    centroid: shapely.Point
    viewpoint: shapely.Point | None
    gain_cells: int
    cells: shapely.MultiPoint


@dataclass(frozen=True, slots=True)
class FrontierList:
    """The frontiers of an exploration at a revision, the largest first.

    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    revision: int
    frame_id: str
    exploration_id: int
    frontiers: tuple[Frontier, ...]
    incarnation: int = 0


@dataclass(frozen=True, slots=True)
class Claim:
    """The answer to a robot that claims a goal.

    goal: None if the exploration has ended, or if other robots have leased all goals; the robot can
        claim again later in the second case.
    incarnation: the incarnation of the map to which the revision belongs, see MapEntry.
    """

    revision: int
    frame_id: str
    exploration_id: int
    state: ExplorationState
    end_reason: EndReason
    goal: Goal | None
    incarnation: int = 0
