#include "wire/catalog.h"

#include <utility>

#include "base/status/status_macros.h"
#include "wire/layer.h"
#include "wire/time.h"

namespace hypermap::wire {

void EncodeFinding(const Finding& finding, v1::Finding* message) {
  message->set_table(finding.table);
  message->set_row(finding.row);
  message->set_problem(finding.problem);
  message->set_can_be_rebuilt(finding.can_be_rebuilt);
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
  if (!entry.problem.empty()) return message->set_problem(entry.problem);
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
          message.incarnation()};
}

absl::StatusOr<LayerEntry> DecodeLayerEntry(absl::string_view field, const v1::Layer& message) {
  HYPERMAP_ASSIGN_OR_RETURN(LayerSpec spec, DecodeLayerSpec(field, message));
  LayerEntry entry{std::move(spec), message.size(), std::nullopt, message.version(),
                   DecodeLayerProperties(message.properties())};
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
