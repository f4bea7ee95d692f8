// Entries of maps, layers and revisions on the wire.
#ifndef HYPERMAP_WIRE_CATALOG_H_
#define HYPERMAP_WIRE_CATALOG_H_

#include <functional>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/layer.pb.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/check_report.h"
#include "map/digest/content_digest.h"
#include "map/entries.h"

namespace hypermap::wire {

void EncodeFinding(const Finding& finding, v1::Finding* message);
CheckReport DecodeCheckReport(const v1::CheckMapResponse& message);

// With the version of each layer (Snapshot::layer_versions).
void EncodeContentDigest(const ContentDigest& digest,
                         const std::map<std::string, Revision, std::less<>>& layer_versions,
                         v1::DigestMapResponse* message);
ContentDigest DecodeContentDigest(const v1::DigestMapResponse& message);

// Of a closed map only the name, the state and the problem are set.
void EncodeMapEntry(const MapEntry& entry, v1::Map* message);
MapEntry DecodeMapEntry(const v1::Map& message);

// Decodes what EncodeLayer (wire/layer.h) encodes.
absl::StatusOr<LayerEntry> DecodeLayerEntry(absl::string_view field, const v1::Layer& message);

void EncodeRevisionRecord(const RevisionRecord& record, v1::RevisionInfo* message);
RevisionRecord DecodeRevisionRecord(const v1::RevisionInfo& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_CATALOG_H_
