// Edits on the wire.
#ifndef HYPERMAP_WIRE_EDIT_H_
#define HYPERMAP_WIRE_EDIT_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "hypermap/v1/edit.pb.h"
#include "hypermap/v1/edit_service.pb.h"
#include "map/edits/edit.h"

namespace hypermap::wire {

void EncodeEdit(const Edit& edit, v1::Edit* message);

void EncodeLayerVersions(const std::vector<LayerVersion>& versions,
                         google::protobuf::RepeatedPtrField<v1::LayerVersion>* messages);

absl::StatusOr<Edit> DecodeEdit(absl::string_view field, const v1::Edit& message,
                                const Limits& limits);

// INVALID_ARGUMENT if there are none, RESOURCE_EXHAUSTED for more than limits.max_edits.
absl::StatusOr<EditBatch> DecodeEdits(const google::protobuf::RepeatedPtrField<v1::Edit>& edits,
                                      const Limits& limits);

// Decodes EditBatch::if_layers. INVALID_ARGUMENT for an entry without a layer.
absl::StatusOr<std::vector<LayerVersion>> DecodeLayerVersions(
    absl::string_view field, const google::protobuf::RepeatedPtrField<v1::LayerVersion>& messages);

// Encodes a batch as bytes, to be stored until it can be sent.
std::string EditsToBytes(const EditBatch& batch);
// DATA_LOSS for bytes that are not a batch; INVALID_ARGUMENT for a batch that servers refuse.
absl::StatusOr<EditBatch> EditsFromBytes(absl::string_view bytes);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_EDIT_H_
