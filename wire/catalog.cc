#include "wire/catalog.h"

#include <utility>

#include "base/status/status_macros.h"
#include "wire/layer.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

v1::MapState EncodeMapState(MapState state) {
  switch (state) {
    case MapState::kServing:
      return v1::MAP_STATE_SERVING;
    case MapState::kDamaged:
      return v1::MAP_STATE_DAMAGED;
    case MapState::kReadOnly:
      return v1::MAP_STATE_READ_ONLY;
    case MapState::kClosed:
      return v1::MAP_STATE_CLOSED;
  }
  return v1::MAP_STATE_UNSPECIFIED;
}

MapState DecodeMapState(const v1::Map& message) {
  switch (message.state()) {
    case v1::MAP_STATE_SERVING:
      return MapState::kServing;
    case v1::MAP_STATE_DAMAGED:
      return MapState::kDamaged;
    case v1::MAP_STATE_READ_ONLY:
      return MapState::kReadOnly;
    case v1::MAP_STATE_CLOSED:
      return MapState::kClosed;
    default:
      // Older servers tell a problem of closed maps only.
      return message.problem().empty() ? MapState::kServing : MapState::kClosed;
  }
}

}  // namespace

void EncodeFinding(const Finding& finding, v1::Finding* message) {
  message->set_table(finding.table);
  message->set_row(finding.row);
  message->set_problem(finding.problem);
  message->set_can_be_rebuilt(finding.can_be_rebuilt);
}

void EncodeContentDigest(const ContentDigest& digest,
                         const std::map<std::string, Revision, std::less<>>& layer_versions,
                         v1::DigestMapResponse* message) {
  message->set_revision(digest.revision);
  message->set_frames_digest(digest.frames);
  for (const auto& [name, of_layer] : digest.layers) {
    v1::LayerDigest* const layer = message->add_layers();
    layer->set_layer(name);
    layer->set_digest(of_layer);
    const auto version = layer_versions.find(name);
    if (version != layer_versions.end()) layer->set_version(version->second);
  }
}

ContentDigest DecodeContentDigest(const v1::DigestMapResponse& message) {
  ContentDigest digest{.revision = message.revision(), .frames = message.frames_digest()};
  for (const v1::LayerDigest& layer : message.layers()) {
    digest.layers[layer.layer()] = layer.digest();
  }
  return digest;
}

CheckReport DecodeCheckReport(const v1::CheckMapResponse& message) {
  CheckReport report{message.revision(), {}, message.more()};
  for (const v1::Finding& finding : message.findings()) {
    report.findings.push_back(
        {finding.table(), finding.row(), finding.problem(), finding.can_be_rebuilt()});
  }
  return report;
}

void EncodeMapEntry(const MapEntry& entry, v1::Map* message) {
  message->set_name(entry.name);
  message->set_state(EncodeMapState(entry.state));
  message->set_problem(entry.problem);
  if (entry.state == MapState::kClosed) return;
  message->set_frame_id(entry.frame_id);
  message->set_revision(entry.revision);
  EncodeTime(entry.create_time, message->mutable_create_time());
  message->set_layer_count(entry.layer_count);
  message->set_incarnation(entry.incarnation);
}

MapEntry DecodeMapEntry(const v1::Map& message) {
  return {message.name(),        message.frame_id(),
          message.revision(),    DecodeTime(message.create_time()),
          message.layer_count(), message.problem(),
          message.incarnation(), DecodeMapState(message)};
}

absl::StatusOr<LayerEntry> DecodeLayerEntry(absl::string_view field, const v1::Layer& message) {
  HYPERMAP_ASSIGN_OR_RETURN(LayerSpec spec, DecodeLayerSpec(field, message));
  LayerEntry entry{std::move(spec),
                   message.size(),
                   std::nullopt,
                   message.version(),
                   DecodeLayerProperties(message.properties()),
                   message.problem()};
  if (message.has_extent()) entry.extent = DecodeCellBox(message.extent());
  return entry;
}

void EncodeRevisionRecord(const RevisionRecord& record, v1::RevisionInfo* message) {
  message->set_revision(record.revision);
  EncodeTime(record.time, message->mutable_time());
  message->set_author(record.author);
  message->set_num_changes(record.num_changes);
}

RevisionRecord DecodeRevisionRecord(const v1::RevisionInfo& message) {
  return {message.revision(), DecodeTime(message.time()), message.author(), message.num_changes()};
}

}  // namespace hypermap::wire
