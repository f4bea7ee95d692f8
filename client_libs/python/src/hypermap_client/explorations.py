"""Robots exploring an area together. Positions are in the frame that the call names."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum

import shapely


class ExplorationState(IntEnum):
    """Whether robots are still at it."""

    ACTIVE = 1
    ENDED = 2


class EndReason(IntEnum):
    """Why an exploration has ended."""

    NONE = 0
    """It has not."""
    DONE = 1
    """All floor that there is has been seen, but for crumbs."""
    ONLY_UNREACHABLE_LEFT = 2
    """What has not been seen cannot be seen from anywhere that robots can go."""
    STOPPED = 3
    """Somebody stopped it."""


class GoalOutcome(IntEnum):
    """What became of a goal."""

    REACHED = 1
    """The robot has looked round, and its observations are acknowledged."""
    UNREACHABLE = 2
    """The robot cannot get there: nobody is sent there until the floor changes nearby."""
    ABANDONED = 3
    """The robot will not go: the place is free for others."""


@dataclass(frozen=True, slots=True)
class Goal:
    """A place that a robot is on the way to.

    gain_cells: unseen floor in sight from there when it was claimed.
    path_length_m: of the way there from where it was claimed.
    expire_time: when the lease ends.
    """

    id: int
    robot: str
    position: shapely.Point
    gain_cells: int
    path_length_m: float
    expire_time: datetime


@dataclass(frozen=True, slots=True)
class UnreachablePlace:
    """A place that a robot could not get to."""

    id: int
    robot: str
    position: shapely.Point


@dataclass(frozen=True, slots=True)
class Exploration:
    """An area that robots explore; `id` is of an object of the layer "explorations"."""

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
    """Of the floor of an area, in cells of the occupancy layer.

    reachable_cells: not seen yet, and in sight of where robots can go.
    unreachable_cells: not seen, and not so; or looked at twice, and not seen.
    fraction: explored / (explored + reachable); 1 when there are neither.
    rate_m2_per_s: explored in the last minute.
    """

    explored_cells: int
    reachable_cells: int
    unreachable_cells: int
    fraction: float
    rate_m2_per_s: float
    cell_area_m2: float


@dataclass(frozen=True, slots=True)
class ExplorationAnswer:
    """An exploration at a revision. `progress` is None where the call does not tell it."""

    revision: int
    frame_id: str
    exploration: Exploration
    progress: ExplorationProgress | None = None


@dataclass(frozen=True, slots=True)
class ExplorationList:
    """All explorations of a map, the newest first."""

    revision: int
    frame_id: str
    explorations: tuple[Exploration, ...]


@dataclass(frozen=True, slots=True)
class Frontier:
    """Unseen floor beside seen floor, as one piece.

    viewpoint: from where it can be seen and a robot can go; None: from nowhere.
    gain_cells: unseen floor in sight from the viewpoint.
    cells: if asked for: the centres of its cells.
    """

    num_cells: int
    centroid: shapely.Point
    viewpoint: shapely.Point | None
    gain_cells: int
    cells: shapely.MultiPoint


@dataclass(frozen=True, slots=True)
class FrontierList:
    """Where seen floor ends and unseen begins, the largest first."""

    revision: int
    frame_id: str
    exploration_id: int
    frontiers: tuple[Frontier, ...]


@dataclass(frozen=True, slots=True)
class Claim:
    """The goal that a robot was given. None: ask again later, unless the exploration has ended."""

    revision: int
    frame_id: str
    exploration_id: int
    state: ExplorationState
    end_reason: EndReason
    goal: Goal | None
