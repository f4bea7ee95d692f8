#include "client_libs/cpp/decode.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/access.h"
#include "wire/catalog.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::client {

absl::StatusOr<CallerAnswer> DecodeCaller(const v1::GetCallerResponse& message) {
  CallerAnswer caller;
  caller.has_identities = message.has_identities();
  if (!caller.has_identities) return caller;
  caller.identity = message.identity();
  HYPERMAP_ASSIGN_OR_RETURN(caller.role, wire::DecodeRole("role", message.role()));
  caller.maps.assign(message.maps().begin(), message.maps().end());
  caller.robots.assign(message.robots().begin(), message.robots().end());
  if (message.has_expires()) caller.expires = wire::DecodeTime(message.expires());
  return caller;
}

absl::StatusOr<LayerEntry> DecodeLayerEntry(const v1::Layer& message) {
  return wire::DecodeLayerEntry(absl::StrCat("layer ", message.name()), message);
}

absl::StatusOr<LayerList> DecodeLayerList(const v1::ListLayersResponse& message) {
  LayerList list{message.map(), message.revision(), {}, message.incarnation()};
  for (const v1::Layer& layer : message.layers()) {
    HYPERMAP_ASSIGN_OR_RETURN(LayerEntry entry, DecodeLayerEntry(layer));
    list.layers.push_back(std::move(entry));
  }
  return list;
}

absl::StatusOr<TransformList> DecodeTransformList(const v1::ListTransformsResponse& message) {
  TransformList list{
      message.map(), message.revision(), message.frame_id(), {}, message.incarnation()};
  for (const v1::Transform& transform : message.transforms()) {
    HYPERMAP_ASSIGN_OR_RETURN(FrameTransform decoded,
                              wire::DecodeTransform("transform", transform));
    list.transforms.push_back(std::move(decoded));
  }
  return list;
}

RevisionList DecodeRevisionList(const v1::ListRevisionsResponse& message) {
  RevisionList list{message.map(),
                    message.newest_revision(),
                    message.oldest_revision(),
                    {},
                    message.incarnation()};
  for (const v1::RevisionInfo& info : message.revisions()) {
    list.revisions.push_back(wire::DecodeRevisionRecord(info));
  }
  return list;
}

}  // namespace hypermap::client
