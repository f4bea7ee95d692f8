"""Client of Hypermap, a map server that answers the same questions for every layer of a site.

    from hypermap_client import Client

    with Client("127.0.0.1:50051") as client:
        print(client.query_point("office", (12.2, 2.9)))            # what is at this point?
        print(client.query_area("office", shapely.box(10, 0, 14, 5)))  # what is in this area?
        print(client.query_value("office", "chair"))                # where is this value?

`AsyncClient` has the same methods for asyncio. Lengths are in metres and angles in radians.
Coordinates are in the frame that the call names, or in the map's own frame if it names none.
Points, areas and the shapes of objects are Shapely geometries, cells are NumPy arrays, and times
are `datetime`s with time zone UTC.
"""

import importlib.metadata

from ._async.client import AsyncClient
from ._async.observe import AsyncObserveStream
from ._async.watch import AsyncWatch
from ._requests import new_request_id
from ._sync.client import Client
from ._sync.observe import ObserveStream
from ._sync.watch import Watch
from .access import Caller, Role
from .answers import (
    Answer,
    AnswerStatus,
    Consistency,
    LayerAnswer,
    LayerContent,
    LayerRefusal,
    NearestAnswer,
    NearestMatch,
    PointAnswer,
    PointsAnswer,
    PointsContent,
)
from .catalog import (
    CheckReport,
    Finding,
    LayerList,
    MapDigest,
    MapEntry,
    MapState,
    TransformList,
)
from .changes import Change, ChangeKind, Difference, Revision, RevisionList, WatchEvent
from .credentials import Tls
from .edits import (
    CreateLayer,
    DeleteLayer,
    DeleteObject,
    EditAnswer,
    FillPolygon,
    PutObject,
    SetAliases,
    SetTransform,
    WriteCells,
)
from .errors import (
    Aborted,
    AlreadyExists,
    Cancelled,
    DataLoss,
    DeadlineExceeded,
    FailedPrecondition,
    HypermapError,
    Internal,
    InvalidArgument,
    NotFound,
    OutOfRange,
    PermissionDenied,
    ResourceExhausted,
    Unauthenticated,
    Unavailable,
    Unimplemented,
)
from .explorations import (
    Claim,
    EndReason,
    Exploration,
    ExplorationAnswer,
    ExplorationList,
    ExplorationProgress,
    ExplorationState,
    Frontier,
    FrontierList,
    Goal,
    GoalOutcome,
    UnreachablePlace,
)
from .geometry import Pose, ShapeKind, Transform
from .grids import Cell, CellBox, CellRule, CellRuns, Grid, GridGeometry
from .interchange import ExportAnswer, FileFormat, ImportAnswer, NamedFile
from .layers import Layer, LayerKind, LayerProperties, LayerSpec, OccupancyThresholds
from .objects import HeightRange, MapObject
from .observations import (
    Acknowledgement,
    CellPatch,
    CorrectedPose,
    DepthView,
    Detection,
    ObjectEvent,
    ObjectEventKind,
    ObjectHistory,
    Observation,
    ObservationOutcome,
    OpenedLayer,
    SensorPose,
    Smoothing,
)
from .registration import (
    AgreeingPair,
    Ambiguity,
    PointPair,
    ReadSide,
    ScoredTransform,
    TransformEstimate,
    TransformSide,
)
from .robots import ReportAnswer, Robot, RobotChanges, RobotList
from .servers import ServerList, SharedMap, SharingServer

__version__ = importlib.metadata.version("hypermap-client")

__all__ = [
    "Aborted",
    "Acknowledgement",
    "AgreeingPair",
    "AlreadyExists",
    "Ambiguity",
    "Answer",
    "AnswerStatus",
    "AsyncClient",
    "AsyncObserveStream",
    "AsyncWatch",
    "Caller",
    "Cancelled",
    "Cell",
    "CellBox",
    "CellPatch",
    "CellRule",
    "CellRuns",
    "Change",
    "ChangeKind",
    "CheckReport",
    "Claim",
    "Client",
    "Consistency",
    "CorrectedPose",
    "CreateLayer",
    "DataLoss",
    "DeadlineExceeded",
    "DeleteLayer",
    "DeleteObject",
    "DepthView",
    "Detection",
    "Difference",
    "EditAnswer",
    "EndReason",
    "Exploration",
    "ExplorationAnswer",
    "ExplorationList",
    "ExplorationProgress",
    "ExplorationState",
    "ExportAnswer",
    "FailedPrecondition",
    "FileFormat",
    "FillPolygon",
    "Finding",
    "Frontier",
    "FrontierList",
    "Goal",
    "GoalOutcome",
    "Grid",
    "GridGeometry",
    "HeightRange",
    "HypermapError",
    "ImportAnswer",
    "Internal",
    "InvalidArgument",
    "Layer",
    "LayerAnswer",
    "LayerContent",
    "LayerKind",
    "LayerList",
    "LayerProperties",
    "LayerRefusal",
    "LayerSpec",
    "MapDigest",
    "MapEntry",
    "MapObject",
    "MapState",
    "NamedFile",
    "NearestAnswer",
    "NearestMatch",
    "NotFound",
    "ObjectEvent",
    "ObjectEventKind",
    "ObjectHistory",
    "Observation",
    "ObservationOutcome",
    "ObserveStream",
    "OccupancyThresholds",
    "OpenedLayer",
    "OutOfRange",
    "PermissionDenied",
    "PointAnswer",
    "PointPair",
    "PointsAnswer",
    "PointsContent",
    "Pose",
    "PutObject",
    "ReadSide",
    "ReportAnswer",
    "ResourceExhausted",
    "Revision",
    "RevisionList",
    "Robot",
    "RobotChanges",
    "RobotList",
    "Role",
    "ScoredTransform",
    "SensorPose",
    "ServerList",
    "SetAliases",
    "SetTransform",
    "ShapeKind",
    "SharedMap",
    "SharingServer",
    "Smoothing",
    "Tls",
    "Transform",
    "TransformEstimate",
    "TransformList",
    "TransformSide",
    "Unauthenticated",
    "Unavailable",
    "Unimplemented",
    "UnreachablePlace",
    "Watch",
    "WatchEvent",
    "WriteCells",
    "new_request_id",
]
