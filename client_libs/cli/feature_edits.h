// The features of a GeoJSON file as edits that can have conditions and a time to live.
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
  // Of the objects that are put.
  std::optional<absl::Duration> time_to_live = std::nullopt;
  // Of each object that is replaced or deleted.
  std::optional<Revision> if_version = std::nullopt;
  // Of the layer.
  std::optional<Revision> if_layer_version = std::nullopt;

  bool any() const { return time_to_live || if_version || if_layer_version; }
};

struct FeatureEdits {
  EditBatch batch;
  std::vector<std::string> repairs;
};

// Edits of a layer that is there. Unlike an import, a feature whose id is no object's is left for
// the server to refuse. `frame_id` is the map's own. INVALID_ARGUMENT for a time to live or a
// version of what is no object.
absl::StatusOr<FeatureEdits> ReadFeatureEdits(absl::string_view geojson, const LayerSpec& layer,
                                              const std::string& frame_id,
                                              const EditConditions& conditions);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_FEATURE_EDITS_H_
