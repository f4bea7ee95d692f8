"""Calls for explorations."""

from __future__ import annotations

from datetime import timedelta

from .. import _rpc as rpc
from .._proto import exploration_service_pb2 as pb
from .._requests import new_request_id
from .._wire.enums import encode_enum
from .._wire.explorations import (
    decode_claim,
    decode_exploration,
    decode_frontiers,
    decode_goal,
    decode_progress,
)
from .._wire.geometry import encode_polygon, encode_pose
from .._wire.time import encode_duration
from ..explorations import (
    Claim,
    ExplorationAnswer,
    ExplorationList,
    FrontierList,
    Goal,
    GoalOutcome,
)
from ..geometry import AreaLike, Pose
from ..grids import CellRule
from .connection import Connection

MINUTE = timedelta(minutes=1)


class Explorations(Connection):
    """Calls for explorations. The exploration id 0 stands for the newest exploration of the map."""

    async def start_exploration(
        self,
        map_name: str,
        area: AreaLike,
        *,
        occupancy_layer: str,
        exploration_layer: str,
        frame_id: str = "",
        explored_rule: CellRule = CellRule.CENTRE,
        robot_radius_m: float = 0.25,
        range_m: float = 4.0,
        min_gain_cells: int = 4,
        request_id: str = "",
        timeout: float | None = None,
    ) -> ExplorationAnswer:
        """Starts the exploration of an area.

        area: polygon in metres, in `frame_id`. Its border limits the paths of the robots.
        occupancy_layer: layer whose free cells are the floor.
        exploration_layer: layer on which floor is marked as explored; created with `explored_rule`
            if it does not exist.
        robot_radius_m: clearance in metres that paths keep to cells that are not free, in [0, 5],
            and at most 100 cells of the occupancy layer.
        range_m: range of the robots' sensors in metres, in (0, 50], and at most 1,000 cells of
            the occupancy layer.
        min_gain_cells: viewpoints that would reveal fewer cells than this are not assigned.

        Raises FailedPrecondition if the area has no floor, NotFound if there is no such map, layer
        or frame, and ResourceExhausted if the area has too many cells.
        """
        request = pb.StartExplorationRequest(
            map=map_name,
            area=encode_polygon(area),
            frame_id=frame_id,
            occupancy_layer=occupancy_layer,
            exploration_layer=exploration_layer,
            explored_rule=encode_enum(explored_rule),
            robot_radius_m=robot_radius_m,
            range_m=range_m,
            min_gain_cells=min_gain_cells,
            request_id=request_id or new_request_id(),
        )
        answer = await self._call(rpc.START_EXPLORATION, request, timeout)
        exploration = decode_exploration(answer.exploration)
        return ExplorationAnswer(
            answer.revision, frame_id, exploration, incarnation=answer.incarnation
        )

    async def get_exploration(
        self,
        map_name: str,
        exploration_id: int = 0,
        *,
        frame_id: str = "",
        timeout: float | None = None,
    ) -> ExplorationAnswer:
        """Returns an exploration with its progress. Raises NotFound if there is none."""
        request = pb.GetExplorationRequest(
            map=map_name, exploration_id=exploration_id, frame_id=frame_id
        )
        answer = await self._call(rpc.GET_EXPLORATION, request, timeout)
        return ExplorationAnswer(
            answer.revision,
            answer.frame_id,
            decode_exploration(answer.exploration),
            decode_progress(answer.progress),
            answer.incarnation,
        )

    async def list_explorations(
        self, map_name: str, *, frame_id: str = "", timeout: float | None = None
    ) -> ExplorationList:
        """Lists the explorations of a map, the newest first."""
        request = pb.ListExplorationsRequest(map=map_name, frame_id=frame_id)
        answer = await self._call(rpc.LIST_EXPLORATIONS, request, timeout)
        explorations = tuple(map(decode_exploration, answer.explorations))
        return ExplorationList(answer.revision, answer.frame_id, explorations, answer.incarnation)

    async def list_frontiers(
        self,
        map_name: str,
        exploration_id: int = 0,
        *,
        frame_id: str = "",
        with_cells: bool = False,
        timeout: float | None = None,
    ) -> FrontierList:
        """Lists the frontiers between explored and unexplored floor, the largest first.

        with_cells: whether each frontier has the centres of its cells.
        """
        request = pb.ListFrontiersRequest(
            map=map_name, exploration_id=exploration_id, frame_id=frame_id, with_cells=with_cells
        )
        return decode_frontiers(await self._call(rpc.LIST_FRONTIERS, request, timeout))

    async def claim_goal(
        self,
        map_name: str,
        robot: str,
        pose: Pose,
        exploration_id: int = 0,
        *,
        frame_id: str = "",
        lease: timedelta = MINUTE,
        timeout: float | None = None,
    ) -> Claim:
        """Assigns the best viewpoint to a robot as its goal, and leases it to the robot.

        A robot has one goal; an earlier goal is released.

        robot: name of the robot, 1 to 128 characters.
        pose: present pose of the robot, in `frame_id`.
        lease: time for which no other robot is sent to the goal, at most 10 minutes.

        Raises FailedPrecondition if the pose is not near a place where the robot fits.

        This call, `renew_goal` and `release_goal` have no request id. They are safe to retry: a
        second claim releases the goal of the first, and a second release raises NotFound.
        """
        request = pb.ClaimGoalRequest(
            map=map_name,
            exploration_id=exploration_id,
            robot=robot,
            pose=encode_pose(pose),
            frame_id=frame_id,
        )
        encode_duration(lease, request.lease)
        return decode_claim(await self._call(rpc.CLAIM_GOAL, request, timeout))

    async def renew_goal(
        self,
        map_name: str,
        robot: str,
        goal_id: int,
        *,
        lease: timedelta = MINUTE,
        timeout: float | None = None,
    ) -> Goal:
        """Extends the lease of a goal: it lasts for `lease` from now on, at most 10 minutes.

        Raises NotFound if the lease has ended.
        """
        request = pb.RenewGoalRequest(map=map_name, robot=robot, goal_id=goal_id)
        encode_duration(lease, request.lease)
        return decode_goal((await self._call(rpc.RENEW_GOAL, request, timeout)).goal)

    async def release_goal(
        self,
        map_name: str,
        robot: str,
        goal_id: int,
        outcome: GoalOutcome,
        *,
        timeout: float | None = None,
    ) -> int:
        """Reports the outcome of a goal and ends its lease; returns the revision of the change.

        For REACHED, all observations that the robot made there must be acknowledged before. Raises
        NotFound if the lease has ended.
        """
        request = pb.ReleaseGoalRequest(
            map=map_name, robot=robot, goal_id=goal_id, outcome=encode_enum(outcome)
        )
        return (await self._call(rpc.RELEASE_GOAL, request, timeout)).revision

    async def stop_exploration(
        self, map_name: str, exploration_id: int = 0, *, timeout: float | None = None
    ) -> ExplorationAnswer:
        """Ends an exploration and returns it. Does nothing if it has ended already."""
        request = pb.StopExplorationRequest(map=map_name, exploration_id=exploration_id)
        answer = await self._call(rpc.STOP_EXPLORATION, request, timeout)
        exploration = decode_exploration(answer.exploration)
        return ExplorationAnswer(answer.revision, "", exploration, incarnation=answer.incarnation)
