// Prints every message of the bridge in CDR, one on a line: the name of its type, and its bytes in
// hexadecimal. test_messages.py compares them with another implementation's.
#include <iostream>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_replace.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

// Fills the fields with numbers and texts of many lengths, so that all alignments occur.
class Filler {
 public:
  template <typename T>
  void Fill(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = true;
    } else if constexpr (kIsCdrNumber<T>) {
      value = static_cast<T>(++count_ % 100);
    } else {
      std::apply([this](auto&... fields) { (this->Fill(fields), ...); }, T::Tie(value));
    }
  }
  void Fill(std::string& text) { text.assign(++count_ % 6, 'x'); }
  template <typename T>
  void Fill(std::vector<T>& sequence) {
    sequence.resize(1 + ++count_ % 3);
    for (T& element : sequence) Fill(element);
  }
  template <typename T, size_t n>
  void Fill(std::array<T, n>& array) {
    for (T& element : array) Fill(element);
  }

 private:
  int count_ = 0;
};

// "nav_msgs::msg::dds_::OccupancyGrid_" is nav_msgs/msg/OccupancyGrid, and a request
// hypermap_msgs/srv/GetIntAtPoint_Request.
template <typename Message>
void Print(const std::string& type, const std::string& suffix = "") {
  Message message;
  Filler().Fill(message);
  const std::string name =
      absl::StrReplaceAll(type.substr(0, type.size() - 1), {{"::dds_::", "/"}, {"::", "/"}});
  std::cout << name << suffix << " " << absl::BytesToHexString(EncodeCdr(message)) << "\n";
}

template <typename... Messages>
void PrintMessages() {
  (Print<Messages>(Messages::kType), ...);
}

template <typename... Services>
void PrintServices() {
  (Print<typename Services::Request>(Services::kType, "_Request"), ...);
  (Print<typename Services::Response>(Services::kType, "_Response"), ...);
}

}  // namespace
}  // namespace hypermap::ros2

int main() {
  using namespace hypermap::ros2;  // NOLINT(google-build-using-namespace)
  PrintMessages<nav_msgs::OccupancyGrid, map_msgs::OccupancyGridUpdate, tf2_msgs::TFMessage,
                visualization_msgs::MarkerArray, nav2_msgs::CostmapFilterInfo,
                hypermap_msgs::SemanticMap, geometry_msgs::PoseWithCovarianceStamped,
                sensor_msgs::Image, sensor_msgs::CameraInfo, vision_msgs::Detection2DArray,
                rmw_dds_common::ParticipantEntitiesInfo<16>>();
  PrintServices<nav_msgs::GetMap, nav2_msgs::LoadMap, hypermap_msgs::GetIntAtPoint,
                hypermap_msgs::GetStringAtPoint, hypermap_msgs::GetIntsByArea,
                hypermap_msgs::GetStringsByArea, hypermap_msgs::GetLocationsByInt,
                hypermap_msgs::GetLocationsByString, hypermap_msgs::GetSemanticByArea,
                hypermap_msgs::GetSemanticByString>();
}
