#include "map/edits/batch_layers.h"

#include <cstddef>
#include <variant>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace hypermap {

absl::Status CheckLayers(const Snapshot& before, const EditBatch& batch, int max_layers) {
  const auto max = static_cast<size_t>(max_layers);
  if (batch.if_layers.size() > max) {
    return absl::ResourceExhaustedError(absl::StrCat("if_layers has ", batch.if_layers.size(),
                                                     " layers, and --max_layers is ", max_layers));
  }
  absl::flat_hash_map<absl::string_view, bool> exists;  // After the edits so far, if they named it.
  const auto find = [&](absl::string_view layer) {
    const auto named = exists.find(layer);
    return named == exists.end() ? before.HasLayer(layer) : named->second;
  };
  size_t num_layers = before.layers.size() + before.damaged.size();
  size_t num_created = 0;
  for (size_t i = 0; i < batch.edits.size(); ++i) {
    if (const auto* deletion = std::get_if<DeleteLayer>(&batch.edits[i])) {
      if (find(deletion->layer)) --num_layers;
      exists[deletion->layer] = false;
    }
    const auto* creation = std::get_if<CreateLayer>(&batch.edits[i]);
    if (creation == nullptr || find(creation->spec.name)) continue;
    if (num_layers >= max || num_created >= max) {
      return absl::ResourceExhaustedError(
          absl::StrCat("edits[", i, "]: ", num_layers >= max ? "the map has" : "the batch creates",
                       " ", num_layers >= max ? num_layers : num_created,
                       " layers up to here, and --max_layers is ", max_layers));
    }
    ++num_layers;
    ++num_created;
    exists[creation->spec.name] = true;
  }
  return absl::OkStatus();
}

}  // namespace hypermap
