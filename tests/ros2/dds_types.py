"""Messages of ROS 2 for Cyclone DDS, as rmw_cyclonedds_cpp has them on the wire.

Names of types are mangled as rmw does. Requests and replies begin with the 16 bytes by which
rmw_cyclonedds_cpp tells clients and calls apart.
"""

import types
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int8, int32, int64, sequence, uint8, uint32, uint64


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str = ""


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Point32(IdlStruct, typename="geometry_msgs::msg::dds_::Point32_"):
    x: float32 = 0.0
    y: float32 = 0.0
    z: float32 = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseWithCovarianceStamped(
    IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"
):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Polygon(IdlStruct, typename="geometry_msgs::msg::dds_::Polygon_"):
    points: sequence[Point32]


@dataclass
class PointStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PointStamped_"):
    header: Header
    point: Point


@dataclass
class PolygonStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PolygonStamped_"):
    header: Header
    polygon: Polygon


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class BrokenImage(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    """Says to be an image, and ends after its size."""
    header: Header
    height: uint32
    width: uint32


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32 = 0
    y_offset: uint32 = 0
    height: uint32 = 0
    width: uint32 = 0
    do_rectify: bool = False


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class Point2D(IdlStruct, typename="vision_msgs::msg::dds_::Point2D_"):
    x: float64
    y: float64


@dataclass
class Pose2D(IdlStruct, typename="vision_msgs::msg::dds_::Pose2D_"):
    position: Point2D
    theta: float64


@dataclass
class BoundingBox2D(IdlStruct, typename="vision_msgs::msg::dds_::BoundingBox2D_"):
    center: Pose2D
    size_x: float64
    size_y: float64


@dataclass
class ObjectHypothesis(IdlStruct, typename="vision_msgs::msg::dds_::ObjectHypothesis_"):
    class_id: str
    score: float64


@dataclass
class ObjectHypothesisWithPose(
    IdlStruct, typename="vision_msgs::msg::dds_::ObjectHypothesisWithPose_"
):
    hypothesis: ObjectHypothesis
    pose: PoseWithCovariance


@dataclass
class Detection2D(IdlStruct, typename="vision_msgs::msg::dds_::Detection2D_"):
    header: Header
    results: sequence[ObjectHypothesisWithPose]
    bbox: BoundingBox2D
    id: str


@dataclass
class Detection2DArray(IdlStruct, typename="vision_msgs::msg::dds_::Detection2DArray_"):
    header: Header
    detections: sequence[Detection2D]


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class OccupancyGridUpdate(IdlStruct, typename="map_msgs::msg::dds_::OccupancyGridUpdate_"):
    header: Header
    x: int32
    y: int32
    width: uint32
    height: uint32
    data: sequence[int8]


@dataclass
class CostmapFilterInfo(IdlStruct, typename="nav2_msgs::msg::dds_::CostmapFilterInfo_"):
    header: Header
    type: uint8
    filter_mask_topic: str
    base: float32
    multiplier: float32


@dataclass
class SemanticObject(IdlStruct, typename="hypermap_msgs::msg::dds_::SemanticObject_"):
    id: uint32
    shape: Polygon
    name: str
    tags: sequence[str]
    confidence: sequence[float64]


@dataclass
class SemanticMap(IdlStruct, typename="hypermap_msgs::msg::dds_::SemanticMap_"):
    objects: sequence[SemanticObject]


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(
    IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


def call(package, name, request, response):
    """The classes of a service's request and reply; arguments are dictionaries of fields."""
    def make(suffix, fields):
        def fill(namespace):
            namespace["__annotations__"] = {"client": uint64, "number": int64, **fields}
        typename = f"{package}::srv::dds_::{name}_{suffix}_"
        return dataclass(
            types.new_class(name + suffix, (IdlStruct,), {"typename": typename}, fill))
    return make("Request", request), make("Response", response)


AT_POINT = {"layer": str, "location": PointStamped}
BY_AREA = {"layer": str, "area": PolygonStamped}
SERVICES = {
    "get_int_at_point": call("hypermap_msgs", "GetIntAtPoint", AT_POINT, {"value": int32}),
    "get_string_at_point": call("hypermap_msgs", "GetStringAtPoint", AT_POINT, {"name": str}),
    "get_ints_by_area": call("hypermap_msgs", "GetIntsByArea", BY_AREA,
                             {"values": sequence[int32], "locations": sequence[Point]}),
    "get_strings_by_area": call("hypermap_msgs", "GetStringsByArea", BY_AREA,
                                {"names": sequence[str], "locations": sequence[Point]}),
    "get_locations_by_int": call(
        "hypermap_msgs", "GetLocationsByInt",
        {"layer": str, "value": int32, "area": PolygonStamped}, {"locations": sequence[Point]}),
    "get_locations_by_string": call(
        "hypermap_msgs", "GetLocationsByString",
        {"layer": str, "name": str, "area": PolygonStamped}, {"locations": sequence[Point]}),
    "get_semantic_by_area": call("hypermap_msgs", "GetSemanticByArea", {"area": PolygonStamped},
                                 {"objects": sequence[SemanticObject]}),
    "get_semantic_by_string": call("hypermap_msgs", "GetSemanticByString", {"name": str},
                                   {"objects": sequence[SemanticObject]}),
    "map": call("nav_msgs", "GetMap", {"structure_needs_at_least_one_member": uint8},
                {"map": OccupancyGrid}),
    "load_map": call("nav2_msgs", "LoadMap", {"map_url": str},
                     {"map": OccupancyGrid, "result": uint8}),
}
