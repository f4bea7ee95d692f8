"""Robots exploring an area together."""

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
    """Explorations. Exploration 0 is the newest of the map."""

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
        """Begins to explore an area.

        exploration_layer: created when there is none, with `explored_rule`.
        robot_radius_m: robots keep so far from what is not free, in [0, 5].
        range_m: how far robots see, in (0, 50].
        min_gain_cells: what shows fewer new cells is not worth a way.

        FailedPrecondition when there is no floor in the area.
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
        return ExplorationAnswer(answer.revision, frame_id, decode_exploration(answer.exploration))

    async def get_exploration(
        self,
        map_name: str,
        exploration_id: int = 0,
        *,
        frame_id: str = "",
        timeout: float | None = None,
    ) -> ExplorationAnswer:
        """How far an exploration has come (0: the newest of the map)."""
        request = pb.GetExplorationRequest(
            map=map_name, exploration_id=exploration_id, frame_id=frame_id
        )
        answer = await self._call(rpc.GET_EXPLORATION, request, timeout)
        return ExplorationAnswer(
            answer.revision,
            answer.frame_id,
            decode_exploration(answer.exploration),
            decode_progress(answer.progress),
        )

    async def list_explorations(
        self, map_name: str, *, frame_id: str = "", timeout: float | None = None
    ) -> ExplorationList:
        """All explorations of a map, the newest first."""
        request = pb.ListExplorationsRequest(map=map_name, frame_id=frame_id)
        answer = await self._call(rpc.LIST_EXPLORATIONS, request, timeout)
        return ExplorationList(
            answer.revision, answer.frame_id, tuple(map(decode_exploration, answer.explorations))
        )

    async def list_frontiers(
        self,
        map_name: str,
        exploration_id: int = 0,
        *,
        frame_id: str = "",
        with_cells: bool = False,
        timeout: float | None = None,
    ) -> FrontierList:
        """Where seen floor ends and unseen begins, the largest first."""
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
        """Where a robot should look from next. What it had is given back.

        pose: where it is. FailedPrecondition where it can't stand.
        lease: how long nobody else is sent there, at most 10 minutes.

        This call, `renew_goal` and `release_goal` have no request id, and may be sent twice all
        the same: a second claim gives back what the first has got, and a second release finds no
        goal.
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
        """Makes a lease last from now on. NotFound when it has ended."""
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
        """Tells what became of a goal; the revision that did. NotFound when the lease has ended."""
        request = pb.ReleaseGoalRequest(
            map=map_name, robot=robot, goal_id=goal_id, outcome=encode_enum(outcome)
        )
        return (await self._call(rpc.RELEASE_GOAL, request, timeout)).revision

    async def stop_exploration(
        self, map_name: str, exploration_id: int = 0, *, timeout: float | None = None
    ) -> ExplorationAnswer:
        """Ends an exploration; the exploration as it ended. Again is a no-op."""
        request = pb.StopExplorationRequest(map=map_name, exploration_id=exploration_id)
        answer = await self._call(rpc.STOP_EXPLORATION, request, timeout)
        return ExplorationAnswer(answer.revision, "", decode_exploration(answer.exploration))
