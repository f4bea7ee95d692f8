"""The RPCs of hypermap.v1 that the client calls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from google.protobuf.message import Message

from ._proto import access_service_pb2 as access
from ._proto import catalog_service_pb2 as catalog
from ._proto import edit_service_pb2 as edit
from ._proto import exploration_service_pb2 as exploration
from ._proto import frame_service_pb2 as frame
from ._proto import ingest_service_pb2 as ingest
from ._proto import query_service_pb2 as query
from ._proto import robot_service_pb2 as robots
from ._proto import server_service_pb2 as servers
from ._proto import watch_service_pb2 as watch

RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)


@dataclass(frozen=True)
class Rpc(Generic[RequestT, ResponseT]):
    """An RPC: its path, and the types of its request and response messages."""

    path: str
    request: type[RequestT]
    response: type[ResponseT]


def _rpc(
    service: str, request: type[RequestT], response: type[ResponseT]
) -> Rpc[RequestT, ResponseT]:
    # The request of an RPC is named after the RPC.
    name = request.__name__.removesuffix("Request")
    return Rpc(f"/hypermap.v1.{service}/{name}", request, response)


GET_CALLER = _rpc("AccessService", access.GetCallerRequest, access.GetCallerResponse)

CREATE_MAP = _rpc("CatalogService", catalog.CreateMapRequest, catalog.CreateMapResponse)
GET_MAP = _rpc("CatalogService", catalog.GetMapRequest, catalog.GetMapResponse)
LIST_MAPS = _rpc("CatalogService", catalog.ListMapsRequest, catalog.ListMapsResponse)
DELETE_MAP = _rpc("CatalogService", catalog.DeleteMapRequest, catalog.DeleteMapResponse)
CREATE_LAYER = _rpc("CatalogService", catalog.CreateLayerRequest, catalog.CreateLayerResponse)
GET_LAYER = _rpc("CatalogService", catalog.GetLayerRequest, catalog.GetLayerResponse)
LIST_LAYERS = _rpc("CatalogService", catalog.ListLayersRequest, catalog.ListLayersResponse)
DELETE_LAYER = _rpc("CatalogService", catalog.DeleteLayerRequest, catalog.DeleteLayerResponse)
SET_TRANSFORM = _rpc("CatalogService", catalog.SetTransformRequest, catalog.SetTransformResponse)
LIST_TRANSFORMS = _rpc(
    "CatalogService", catalog.ListTransformsRequest, catalog.ListTransformsResponse
)
IMPORT_MAP = _rpc("CatalogService", catalog.ImportMapRequest, catalog.ImportMapResponse)
EXPORT_MAP = _rpc("CatalogService", catalog.ExportMapRequest, catalog.ExportMapResponse)
BACKUP_MAP = _rpc("CatalogService", catalog.BackupMapRequest, catalog.BackupMapResponse)
CHECK_MAP = _rpc("CatalogService", catalog.CheckMapRequest, catalog.CheckMapResponse)
DIGEST_MAP = _rpc("CatalogService", catalog.DigestMapRequest, catalog.DigestMapResponse)
RESTORE_MAP = _rpc("CatalogService", catalog.RestoreMapRequest, catalog.RestoreMapResponse)

QUERY_POINT = _rpc("QueryService", query.QueryPointRequest, query.QueryPointResponse)
QUERY_POINTS = _rpc("QueryService", query.QueryPointsRequest, query.QueryPointsResponse)
QUERY_AREA = _rpc("QueryService", query.QueryAreaRequest, query.QueryAreaResponse)
QUERY_VALUE = _rpc("QueryService", query.QueryValueRequest, query.QueryValueResponse)
QUERY_NEAREST = _rpc("QueryService", query.QueryNearestRequest, query.QueryNearestResponse)
ESTIMATE_TRANSFORM = _rpc(
    "QueryService", query.EstimateTransformRequest, query.EstimateTransformResponse
)

APPLY_EDITS = _rpc("EditService", edit.ApplyEditsRequest, edit.ApplyEditsResponse)

REPORT = _rpc("RobotService", robots.ReportRequest, robots.ReportResponse)
LIST_ROBOTS = _rpc("RobotService", robots.ListRobotsRequest, robots.ListRobotsResponse)
WATCH_ROBOTS = _rpc("RobotService", robots.WatchRobotsRequest, robots.WatchRobotsResponse)

LIST_SERVERS = _rpc("ServerService", servers.ListServersRequest, servers.ListServersResponse)
DRAIN_SERVER = _rpc("ServerService", servers.DrainServerRequest, servers.DrainServerResponse)

WATCH = _rpc("WatchService", watch.WatchRequest, watch.WatchResponse)
LIST_CHANGES = _rpc("WatchService", watch.ListChangesRequest, watch.ListChangesResponse)
LIST_REVISIONS = _rpc("WatchService", watch.ListRevisionsRequest, watch.ListRevisionsResponse)

STREAM_FRAMES = _rpc("FrameService", frame.StreamFramesRequest, frame.StreamFramesResponse)

OBSERVE = _rpc("IngestService", ingest.ObserveRequest, ingest.ObserveResponse)
REBUILD_LAYER = _rpc("IngestService", ingest.RebuildLayerRequest, ingest.RebuildLayerResponse)
RETRACT_SOURCE = _rpc("IngestService", ingest.RetractSourceRequest, ingest.RetractSourceResponse)
SMOOTH_POSES = _rpc("IngestService", ingest.SmoothPosesRequest, ingest.SmoothPosesResponse)
CORRECT_POSES = _rpc("IngestService", ingest.CorrectPosesRequest, ingest.CorrectPosesResponse)
EXPLAIN_OBJECT = _rpc("IngestService", ingest.ExplainObjectRequest, ingest.ExplainObjectResponse)

START_EXPLORATION = _rpc(
    "ExplorationService", exploration.StartExplorationRequest, exploration.StartExplorationResponse
)
GET_EXPLORATION = _rpc(
    "ExplorationService", exploration.GetExplorationRequest, exploration.GetExplorationResponse
)
LIST_EXPLORATIONS = _rpc(
    "ExplorationService", exploration.ListExplorationsRequest, exploration.ListExplorationsResponse
)
LIST_FRONTIERS = _rpc(
    "ExplorationService", exploration.ListFrontiersRequest, exploration.ListFrontiersResponse
)
CLAIM_GOAL = _rpc("ExplorationService", exploration.ClaimGoalRequest, exploration.ClaimGoalResponse)
RENEW_GOAL = _rpc("ExplorationService", exploration.RenewGoalRequest, exploration.RenewGoalResponse)
RELEASE_GOAL = _rpc(
    "ExplorationService", exploration.ReleaseGoalRequest, exploration.ReleaseGoalResponse
)
STOP_EXPLORATION = _rpc(
    "ExplorationService", exploration.StopExplorationRequest, exploration.StopExplorationResponse
)
