#include "client_libs/ros2/bridge/loaded_map.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"

namespace hypermap::ros2 {
namespace {

using nav2_msgs::LoadMap;

constexpr absl::Duration kTimeout = absl::Seconds(20);

// The layer as it was, from runs of its cells.
absl::StatusOr<GridLayer> Assemble(const LayerSpec& spec, const std::vector<CellRun>& runs) {
  auto layer = std::make_shared<const GridLayer>(spec, MakeCellDomain(spec));
  GridWriter writer(layer);
  for (const CellRun& run : runs) {
    const CellBox box{run.row, run.row + 1, run.col_begin, run.col_end};
    const std::vector<std::optional<double>> values(box.cols(), run.value);
    HYPERMAP_RETURN_IF_ERROR(writer.Write(box, values));
  }
  return *std::move(writer).Finish().layer;
}

absl::StatusOr<GridLayer> Fetch(client::Client& client, const MapAddress& address) {
  client::CallOptions options;
  options.timeout = kTimeout;
  options.retry_for = absl::ZeroDuration();
  HYPERMAP_ASSIGN_OR_RETURN(const LayerEntry entry,
                            client.GetLayer(address.map, address.layer, options));
  if (entry.spec.kind != LayerKind::kOccupancy) {
    return absl::FailedPreconditionError("the layer is not an occupancy grid");
  }
  // Extents only grow, so the newest contains all cells of the past.
  std::vector<CellRun> runs;
  if (entry.extent && !entry.extent->empty()) {
    const Polygon area = Polygon::FromBox(entry.spec.grid->BoundsOf(*entry.extent));
    if (address.revision) options.as_of = AsOf{*address.revision};
    client::AnswerReader reader =
        client.QueryArea(address.map, area, {{address.layer}, entry.spec.frame_id}, options);
    while (std::optional<client::LayerPart> part = reader.Next()) {
      runs.insert(runs.end(), part->runs.begin(), part->runs.end());
    }
    HYPERMAP_RETURN_IF_ERROR(reader.status());
  }
  return Assemble(entry.spec, runs);
}

uint8_t ResultOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return LoadMap::Response::kSuccess;
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kInvalidArgument:
      return LoadMap::Response::kMapDoesNotExist;
    case absl::StatusCode::kFailedPrecondition:
      return LoadMap::Response::kInvalidMapData;
    default:
      return LoadMap::Response::kUndefinedFailure;
  }
}

}  // namespace

absl::StatusOr<MapAddress> ParseMapAddress(absl::string_view text) {
  const auto wrong = [&] {
    return absl::InvalidArgumentError(absl::StrCat(
        "\"", text, "\" is not hypermap://MAP/LAYER or hypermap://MAP/LAYER@REVISION"));
  };
  absl::string_view rest = text;
  if (!absl::ConsumePrefix(&rest, "hypermap://")) return wrong();
  const size_t slash = rest.find('/');
  if (slash == absl::string_view::npos) return wrong();
  MapAddress address;
  address.map = std::string(rest.substr(0, slash));
  rest.remove_prefix(slash + 1);
  const size_t at = rest.find('@');
  address.layer = std::string(rest.substr(0, at));
  if (at != absl::string_view::npos) {
    Revision revision = 0;
    if (!absl::SimpleAtoi(rest.substr(at + 1), &revision) || revision < 0) return wrong();
    address.revision = revision;
  }
  if (address.map.empty() || address.layer.empty()) return wrong();
  return address;
}

LoadMap::Response LoadMapFrom(client::Client& client, const std::string& address, GridMode mode) {
  LoadMap::Response response;
  const absl::StatusOr<MapAddress> parsed = ParseMapAddress(address);
  const absl::StatusOr<GridLayer> layer =
      parsed.ok() ? Fetch(client, *parsed) : absl::StatusOr<GridLayer>(parsed.status());
  response.result = ResultOf(layer.status());
  if (layer.ok()) {
    response.map = ToOccupancyGrid(*layer, mode, absl::Now());
  } else {
    logging::Log(logging::Level::kWarning, "a map is not loaded",
                 {{"url", address}, {"problem", layer.status().ToString()}});
  }
  return response;
}

}  // namespace hypermap::ros2
