// The messages and services of ROS 2 that the bridge speaks, as plain structs. Their fields are
// those of the .msg and .srv files of the packages that the namespaces are named after, as of
// Humble and later. Lengths are in metres, durations in seconds and nanoseconds, and orientations
// are unit quaternions.
//
// kType is the name of a type on the wire. That of a service is followed by "Request_" or
// "Response_".
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_MESSAGES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_MESSAGES_H_

#include <array>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

namespace hypermap::ros2 {

namespace builtin_interfaces {

struct Time {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.sec, m.nanosec);
  }
};

struct Duration {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.sec, m.nanosec);
  }
};

}  // namespace builtin_interfaces

namespace std_msgs {

struct Header {
  builtin_interfaces::Time stamp;
  std::string frame_id;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.stamp, m.frame_id);
  }
};

struct ColorRGBA {
  float r = 0;
  float g = 0;
  float b = 0;
  float a = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.r, m.g, m.b, m.a);
  }
};

}  // namespace std_msgs

namespace geometry_msgs {

struct Point {
  double x = 0;
  double y = 0;
  double z = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x, m.y, m.z);
  }
};

struct Point32 {
  float x = 0;
  float y = 0;
  float z = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x, m.y, m.z);
  }
};

struct Vector3 {
  double x = 0;
  double y = 0;
  double z = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x, m.y, m.z);
  }
};

struct Quaternion {
  double x = 0;
  double y = 0;
  double z = 0;
  double w = 1;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x, m.y, m.z, m.w);
  }
};

struct Pose {
  Point position;
  Quaternion orientation;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.position, m.orientation);
  }
};

struct Transform {
  Vector3 translation;
  Quaternion rotation;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.translation, m.rotation);
  }
};

struct TransformStamped {
  std_msgs::Header header;
  std::string child_frame_id;
  Transform transform;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.child_frame_id, m.transform);
  }
};

struct Polygon {
  std::vector<Point32> points;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.points);
  }
};

struct PointStamped {
  std_msgs::Header header;
  Point point;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.point);
  }
};

struct PolygonStamped {
  std_msgs::Header header;
  Polygon polygon;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.polygon);
  }
};

struct PoseWithCovariance {
  Pose pose;
  // Of x, y, z and the rotations about these axes, row by row.
  std::array<double, 36> covariance{};
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.pose, m.covariance);
  }
};

struct PoseWithCovarianceStamped {
  static constexpr char kType[] = "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_";
  std_msgs::Header header;
  PoseWithCovariance pose;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.pose);
  }
};

}  // namespace geometry_msgs

namespace nav_msgs {

struct MapMetaData {
  builtin_interfaces::Time map_load_time;
  float resolution = 0;
  uint32_t width = 0;
  uint32_t height = 0;
  geometry_msgs::Pose origin;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.map_load_time, m.resolution, m.width, m.height, m.origin);
  }
};

struct OccupancyGrid {
  static constexpr char kType[] = "nav_msgs::msg::dds_::OccupancyGrid_";
  std_msgs::Header header;
  MapMetaData info;
  std::vector<int8_t> data;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.info, m.data);
  }
};

struct GetMap {
  static constexpr char kType[] = "nav_msgs::srv::dds_::GetMap_";
  struct Request {
    uint8_t structure_needs_at_least_one_member = 0;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.structure_needs_at_least_one_member);
    }
  };
  struct Response {
    OccupancyGrid map;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.map);
    }
  };
};

}  // namespace nav_msgs

namespace map_msgs {

struct OccupancyGridUpdate {
  static constexpr char kType[] = "map_msgs::msg::dds_::OccupancyGridUpdate_";
  std_msgs::Header header;
  int32_t x = 0;
  int32_t y = 0;
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<int8_t> data;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.x, m.y, m.width, m.height, m.data);
  }
};

}  // namespace map_msgs

namespace tf2_msgs {

struct TFMessage {
  static constexpr char kType[] = "tf2_msgs::msg::dds_::TFMessage_";
  std::vector<geometry_msgs::TransformStamped> transforms;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.transforms);
  }
};

}  // namespace tf2_msgs

namespace sensor_msgs {

struct CompressedImage {
  std_msgs::Header header;
  std::string format;
  std::vector<uint8_t> data;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.format, m.data);
  }
};

struct Image {
  static constexpr char kType[] = "sensor_msgs::msg::dds_::Image_";
  std_msgs::Header header;
  uint32_t height = 0;
  uint32_t width = 0;
  std::string encoding;
  uint8_t is_bigendian = 0;
  uint32_t step = 0;  // bytes of a row
  std::vector<uint8_t> data;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
  }
};

struct RegionOfInterest {
  uint32_t x_offset = 0;
  uint32_t y_offset = 0;
  uint32_t height = 0;
  uint32_t width = 0;
  bool do_rectify = false;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x_offset, m.y_offset, m.height, m.width, m.do_rectify);
  }
};

struct CameraInfo {
  static constexpr char kType[] = "sensor_msgs::msg::dds_::CameraInfo_";
  std_msgs::Header header;
  uint32_t height = 0;
  uint32_t width = 0;
  std::string distortion_model;
  std::vector<double> d;
  // 3×3, 3×3 and 3×4 matrices, row by row.
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  uint32_t binning_x = 0;
  uint32_t binning_y = 0;
  RegionOfInterest roi;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.height, m.width, m.distortion_model, m.d, m.k, m.r, m.p,
                    m.binning_x, m.binning_y, m.roi);
  }
};

}  // namespace sensor_msgs

namespace vision_msgs {

struct Point2D {
  double x = 0;
  double y = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.x, m.y);
  }
};

struct Pose2D {
  Point2D position;
  double theta = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.position, m.theta);
  }
};

struct BoundingBox2D {
  Pose2D center;
  double size_x = 0;
  double size_y = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.center, m.size_x, m.size_y);
  }
};

struct ObjectHypothesis {
  std::string class_id;
  double score = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.class_id, m.score);
  }
};

struct ObjectHypothesisWithPose {
  ObjectHypothesis hypothesis;
  geometry_msgs::PoseWithCovariance pose;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.hypothesis, m.pose);
  }
};

struct Detection2D {
  std_msgs::Header header;
  std::vector<ObjectHypothesisWithPose> results;
  BoundingBox2D bbox;
  std::string id;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.results, m.bbox, m.id);
  }
};

struct Detection2DArray {
  static constexpr char kType[] = "vision_msgs::msg::dds_::Detection2DArray_";
  std_msgs::Header header;
  std::vector<Detection2D> detections;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.detections);
  }
};

}  // namespace vision_msgs

namespace visualization_msgs {

struct UVCoordinate {
  float u = 0;
  float v = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.u, m.v);
  }
};

struct MeshFile {
  std::string filename;
  std::vector<uint8_t> data;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.filename, m.data);
  }
};

struct Marker {
  enum Type : int32_t {
    kArrow = 0,
    kCube = 1,
    kSphere = 2,
    kLineStrip = 4,
    kLineList = 5,
    kTextViewFacing = 9,
    kTriangleList = 11
  };
  enum Action : int32_t { kAdd = 0, kDelete = 2, kDeleteAll = 3 };

  std_msgs::Header header;
  std::string ns;
  int32_t id = 0;
  int32_t type = 0;
  int32_t action = 0;
  geometry_msgs::Pose pose;
  geometry_msgs::Vector3 scale;
  std_msgs::ColorRGBA color;
  builtin_interfaces::Duration lifetime;
  bool frame_locked = false;
  std::vector<geometry_msgs::Point> points;
  std::vector<std_msgs::ColorRGBA> colors;
  std::string texture_resource;
  sensor_msgs::CompressedImage texture;
  std::vector<UVCoordinate> uv_coordinates;
  std::string text;
  std::string mesh_resource;
  MeshFile mesh_file;
  bool mesh_use_embedded_materials = false;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.ns, m.id, m.type, m.action, m.pose, m.scale, m.color, m.lifetime,
                    m.frame_locked, m.points, m.colors, m.texture_resource, m.texture,
                    m.uv_coordinates, m.text, m.mesh_resource, m.mesh_file,
                    m.mesh_use_embedded_materials);
  }
};

struct MarkerArray {
  static constexpr char kType[] = "visualization_msgs::msg::dds_::MarkerArray_";
  std::vector<Marker> markers;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.markers);
  }
};

}  // namespace visualization_msgs

namespace nav2_msgs {

struct CostmapFilterInfo {
  static constexpr char kType[] = "nav2_msgs::msg::dds_::CostmapFilterInfo_";
  enum Type : uint8_t { kKeepOut = 0, kSpeedPercent = 1, kSpeedAbsolute = 2 };

  std_msgs::Header header;
  uint8_t type = 0;
  std::string filter_mask_topic;
  float base = 0;
  float multiplier = 0;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.header, m.type, m.filter_mask_topic, m.base, m.multiplier);
  }
};

struct LoadMap {
  static constexpr char kType[] = "nav2_msgs::srv::dds_::LoadMap_";
  struct Request {
    std::string map_url;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.map_url);
    }
  };
  struct Response {
    enum Result : uint8_t {
      kSuccess = 0,
      kMapDoesNotExist = 1,
      kInvalidMapData = 2,
      kUndefinedFailure = 255
    };

    nav_msgs::OccupancyGrid map;
    uint8_t result = 0;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.map, m.result);
    }
  };
};

}  // namespace nav2_msgs

namespace hypermap_msgs {

struct SemanticObject {
  uint32_t id = 0;
  geometry_msgs::Polygon shape;
  std::string name;
  std::vector<std::string> tags;
  std::vector<double> confidence;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.id, m.shape, m.name, m.tags, m.confidence);
  }
};

struct SemanticMap {
  static constexpr char kType[] = "hypermap_msgs::msg::dds_::SemanticMap_";
  std::vector<SemanticObject> objects;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.objects);
  }
};

struct GetIntAtPoint {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetIntAtPoint_";
  struct Request {
    std::string layer;
    geometry_msgs::PointStamped location;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.location);
    }
  };
  struct Response {
    int32_t value = 0;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.value);
    }
  };
};

struct GetIntsByArea {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetIntsByArea_";
  struct Request {
    std::string layer;
    geometry_msgs::PolygonStamped area;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.area);
    }
  };
  struct Response {
    std::vector<int32_t> values;
    std::vector<geometry_msgs::Point> locations;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.values, m.locations);
    }
  };
};

struct GetLocationsByInt {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetLocationsByInt_";
  struct Request {
    std::string layer;
    int32_t value = 0;
    geometry_msgs::PolygonStamped area;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.value, m.area);
    }
  };
  struct Response {
    std::vector<geometry_msgs::Point> locations;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.locations);
    }
  };
};

struct GetLocationsByString {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetLocationsByString_";
  struct Request {
    std::string layer;
    std::string name;
    geometry_msgs::PolygonStamped area;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.name, m.area);
    }
  };
  struct Response {
    std::vector<geometry_msgs::Point> locations;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.locations);
    }
  };
};

struct GetStringAtPoint {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetStringAtPoint_";
  struct Request {
    std::string layer;
    geometry_msgs::PointStamped location;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.location);
    }
  };
  struct Response {
    std::string name;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.name);
    }
  };
};

struct GetStringsByArea {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetStringsByArea_";
  struct Request {
    std::string layer;
    geometry_msgs::PolygonStamped area;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.layer, m.area);
    }
  };
  struct Response {
    std::vector<std::string> names;
    std::vector<geometry_msgs::Point> locations;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.names, m.locations);
    }
  };
};

struct GetSemanticByArea {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetSemanticByArea_";
  struct Request {
    geometry_msgs::PolygonStamped area;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.area);
    }
  };
  struct Response {
    std::vector<SemanticObject> objects;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.objects);
    }
  };
};

struct GetSemanticByString {
  static constexpr char kType[] = "hypermap_msgs::srv::dds_::GetSemanticByString_";
  struct Request {
    std::string name;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.name);
    }
  };
  struct Response {
    std::vector<SemanticObject> objects;
    template <typename M>
    static auto Tie(M& m) {
      return std::tie(m.objects);
    }
  };
};

}  // namespace hypermap_msgs

namespace rmw_dds_common {

// A Gid of `n` bytes: 24 up to Humble, 16 since Iron.
template <size_t n>
struct Gid {
  std::array<uint8_t, n> data{};
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.data);
  }
};

template <size_t n>
struct NodeEntitiesInfo {
  std::string node_namespace;
  std::string node_name;
  std::vector<Gid<n>> reader_gid_seq;
  std::vector<Gid<n>> writer_gid_seq;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.node_namespace, m.node_name, m.reader_gid_seq, m.writer_gid_seq);
  }
};

template <size_t n>
struct ParticipantEntitiesInfo {
  static constexpr char kType[] = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  Gid<n> gid;
  std::vector<NodeEntitiesInfo<n>> node_entities_info_seq;
  template <typename M>
  static auto Tie(M& m) {
    return std::tie(m.gid, m.node_entities_info_seq);
  }
};

}  // namespace rmw_dds_common
}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_MESSAGES_MESSAGES_H_
