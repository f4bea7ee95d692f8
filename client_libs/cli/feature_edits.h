// Converts the features of a GeoJSON file to edits with conditions and expiry.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_FEATURE_EDITS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_FEATURE_EDITS_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client_libs/cpp/answers.h"
#include "map/edits/edit.h"

namespace hypermap::cli {

struct EditConditions {
  // For the objects that are put.
  std::optional<absl::Duration> time_to_live = std::nullopt;
  // For each object that is replaced or deleted.
  std::optional<Revision> if_version = std::nullopt;
  // For the layer.
  std::optional<Revision> if_layer_version = std::nullopt;

  bool any() const { return time_to_live || if_version || if_layer_version; }
};

struct FeatureEdits {
  EditBatch batch;
  std::vector<std::string> repairs;
};

// Returns edits of an existing layer. A feature whose id is no object's becomes an edit that the
// server refuses, whereas an import would create an object. `frame_id` is the map's own frame.
// INVALID_ARGUMENT if a condition is set for a feature that is not an object.
absl::StatusOr<FeatureEdits> ReadFeatureEdits(absl::string_view geojson, const LayerSpec& layer,
                                              const std::string& frame_id,
                                              const EditConditions& conditions);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_FEATURE_EDITS_H_
