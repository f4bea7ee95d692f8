"""Conversion of explorations, goals and frontiers."""

from __future__ import annotations

import shapely

from .._proto import exploration_service_pb2 as pb
from ..explorations import (
    Claim,
    EndReason,
    Exploration,
    ExplorationProgress,
    ExplorationState,
    Frontier,
    FrontierList,
    Goal,
    UnreachablePlace,
)
from .enums import decode_enum
from .geometry import decode_point, decode_polygon
from .time import decode_time


def decode_goal(message: pb.Goal) -> Goal:
    return Goal(
        message.id,
        message.robot,
        decode_point(message.position),
        message.gain_cells,
        message.path_length_m,
        decode_time(message.expire_time),
    )


def decode_exploration(message: pb.Exploration) -> Exploration:
    return Exploration(
        id=message.id,
        state=decode_enum(ExplorationState, message.state),
        end_reason=decode_enum(EndReason, message.end_reason),
        area=decode_polygon(message.area),
        occupancy_layer=message.occupancy_layer,
        exploration_layer=message.exploration_layer,
        robot_radius_m=message.robot_radius_m,
        range_m=message.range_m,
        min_gain_cells=message.min_gain_cells,
        start_time=decode_time(message.start_time),
        end_time=decode_time(message.end_time) if message.HasField("end_time") else None,
        goals=tuple(map(decode_goal, message.goals)),
        unreachable_places=tuple(
            UnreachablePlace(place.id, place.robot, decode_point(place.position))
            for place in message.unreachable_places
        ),
    )


def decode_progress(message: pb.ExplorationProgress) -> ExplorationProgress:
    return ExplorationProgress(
        message.explored_cells,
        message.reachable_cells,
        message.unreachable_cells,
        message.fraction,
        message.rate_m2_per_s,
        message.cell_area_m2,
    )


def decode_frontiers(message: pb.ListFrontiersResponse) -> FrontierList:
    return FrontierList(
        message.revision,
        message.frame_id,
        message.exploration_id,
        tuple(
            Frontier(
                frontier.num_cells,
                decode_point(frontier.centroid),
                decode_point(frontier.viewpoint) if frontier.HasField("viewpoint") else None,
                frontier.gain_cells,
                shapely.MultiPoint([(cell.x, cell.y) for cell in frontier.cells]),
            )
            for frontier in message.frontiers
        ),
        message.incarnation,
    )


def decode_claim(message: pb.ClaimGoalResponse) -> Claim:
    return Claim(
        message.revision,
        message.frame_id,
        message.exploration_id,
        decode_enum(ExplorationState, message.state),
        decode_enum(EndReason, message.end_reason),
        decode_goal(message.goal) if message.HasField("goal") else None,
        message.incarnation,
    )
