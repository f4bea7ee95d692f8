#include "wire/edit.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/object.h"
#include "wire/time.h"
#include "wire/version_01.h"

namespace hypermap::wire {
namespace {

struct Encoder {
  v1::Edit* message;

  void operator()(const PutObject& edit) const {
    v1::PutObject* put = message->mutable_put_object();
    put->set_layer(edit.layer);
    put->set_frame_id(edit.frame_id);
    EncodeObject(edit.object, PlanarTransform(), put->mutable_object());
    if (edit.if_version) put->set_if_version(*edit.if_version);
    if (edit.time_to_live) EncodeDuration(*edit.time_to_live, put->mutable_time_to_live());
  }
  void operator()(const DeleteObject& edit) const {
    message->mutable_delete_object()->set_layer(edit.layer);
    message->mutable_delete_object()->set_id(edit.id);
    if (edit.if_version) message->mutable_delete_object()->set_if_version(*edit.if_version);
  }
  void operator()(const WriteCells& edit) const {
    v1::WriteCells* write = message->mutable_write_cells();
    write->set_layer(edit.layer);
    EncodeCellBox(edit.box, write->mutable_box());
    write->mutable_values()->Reserve(static_cast<int>(edit.values.size()));
    for (const std::optional<double>& value : edit.values) {
      write->add_values(value.value_or(kUnknownValue));
    }
  }
  void operator()(const FillPolygon& edit) const {
    v1::FillPolygon* fill = message->mutable_fill_polygon();
    fill->set_layer(edit.layer);
    EncodePolygon(edit.area, fill->mutable_area());
    fill->set_frame_id(edit.frame_id);
    fill->set_rule(EncodeCellRule(edit.rule));
    if (edit.value) fill->set_value(*edit.value);
  }
  void operator()(const SetAliases& edit) const {
    message->mutable_set_aliases()->set_layer(edit.layer);
    EncodeAliases(edit.aliases, message->mutable_set_aliases()->mutable_aliases());
  }
  void operator()(const CreateLayer& edit) const {
    EncodeLayerSpec(edit.spec, message->mutable_create_layer()->mutable_layer());
  }
  void operator()(const DeleteLayer& edit) const {
    message->mutable_delete_layer()->set_layer(edit.layer);
  }
  void operator()(const SetTransform& edit) const {
    EncodeTransform(edit.transform, message->mutable_set_transform()->mutable_transform());
  }
};

absl::StatusOr<Edit> DecodePutObject(const std::string& field, const v1::PutObject& message,
                                     const Limits& limits) {
  const std::string object_field = field + ".object";
  if (!message.has_object()) return InvalidField(object_field, "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(SemanticObject object,
                            DecodeObject(object_field, message.object(), limits));
  PutObject edit{message.layer(), std::move(object), message.frame_id()};
  if (message.has_if_version()) edit.if_version = message.if_version();
  if (message.has_time_to_live()) {
    HYPERMAP_ASSIGN_OR_RETURN(const absl::Duration time_to_live,
                              DecodeDuration(field + ".time_to_live", message.time_to_live()));
    edit.time_to_live = time_to_live;
  }
  return edit;
}

Edit DecodeDeleteObject(const v1::DeleteObject& message) {
  DeleteObject edit{message.layer(), message.id()};
  if (message.has_if_version()) edit.if_version = message.if_version();
  return edit;
}

absl::StatusOr<Edit> DecodeWriteCells(const std::string& field, const v1::WriteCells& message,
                                      const Limits& limits) {
  if (message.values_size() > limits.max_cells) {
    return absl::ResourceExhaustedError(absl::StrCat(field, ".values has ", message.values_size(),
                                                     " cells, --max_cells is ", limits.max_cells));
  }
  constexpr size_t kValuesPerLook = 4'096;
  WriteCells edit{message.layer(), DecodeCellBox(message.box()), {}};
  edit.values.reserve(message.values_size());
  for (const double value : message.values()) {
    if (edit.values.size() % kValuesPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (std::isinf(value)) {
      return InvalidField(absl::StrCat(field, ".values[", edit.values.size(), "]"),
                          "is not finite");
    }
    edit.values.push_back(std::isnan(value) ? std::nullopt : std::optional(value));
  }
  return edit;
}

absl::StatusOr<Edit> DecodeFillPolygon(const std::string& field, const v1::FillPolygon& message,
                                       const Limits& limits) {
  const std::string area_field = field + ".area";
  if (!message.has_area()) return InvalidField(area_field, "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(Polygon area, DecodePolygon(area_field, message.area(), limits));
  HYPERMAP_ASSIGN_OR_RETURN(const CellRule rule, DecodeCellRule(field + ".rule", message.rule()));
  FillPolygon edit{message.layer(), std::move(area), message.frame_id(), rule, std::nullopt};
  if (message.has_value()) {
    if (!std::isfinite(message.value())) return InvalidField(field + ".value", "is not finite");
    edit.value = message.value();
  }
  return edit;
}

absl::StatusOr<Edit> DecodeSetAliases(const std::string& field, const v1::SetAliases& message) {
  if (message.aliases().empty()) return InvalidField(field + ".aliases", "is empty");
  HYPERMAP_ASSIGN_OR_RETURN(ValueAliases aliases,
                            DecodeAliases(field + ".aliases", message.aliases()));
  return SetAliases{message.layer(), std::move(aliases)};
}

absl::StatusOr<Edit> DecodeCreateLayer(const std::string& field, const v1::CreateLayer& message) {
  if (!message.has_layer()) return InvalidField(field + ".layer", "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(LayerSpec spec, DecodeLayerSpec(field + ".layer", message.layer()));
  return CreateLayer{std::move(spec)};
}

absl::StatusOr<Edit> DecodeSetTransform(const std::string& field, const v1::SetTransform& message) {
  if (!message.has_transform()) return InvalidField(field + ".transform", "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(FrameTransform transform,
                            DecodeTransform(field + ".transform", message.transform()));
  return SetTransform{std::move(transform)};
}

}  // namespace

void EncodeEdit(const Edit& edit, v1::Edit* message) { std::visit(Encoder{message}, edit); }

void EncodeLayerVersions(const std::vector<LayerVersion>& versions,
                         google::protobuf::RepeatedPtrField<v1::LayerVersion>* messages) {
  for (const LayerVersion& version : versions) {
    v1::LayerVersion* message = messages->Add();
    message->set_layer(version.layer);
    message->set_version(version.version);
  }
}

absl::StatusOr<Edit> DecodeEdit(absl::string_view field, const v1::Edit& message,
                                const Limits& limits) {
  switch (message.edit_case()) {
    case v1::Edit::kPutObject:
      return DecodePutObject(absl::StrCat(field, ".put_object"), message.put_object(), limits);
    case v1::Edit::kDeleteObject:
      return DecodeDeleteObject(message.delete_object());
    case v1::Edit::kWriteCells:
      return DecodeWriteCells(absl::StrCat(field, ".write_cells"), message.write_cells(), limits);
    case v1::Edit::kFillPolygon:
      return DecodeFillPolygon(absl::StrCat(field, ".fill_polygon"), message.fill_polygon(),
                               limits);
    case v1::Edit::kSetAliases:
      return DecodeSetAliases(absl::StrCat(field, ".set_aliases"), message.set_aliases());
    case v1::Edit::kCreateLayer:
      return DecodeCreateLayer(absl::StrCat(field, ".create_layer"), message.create_layer());
    case v1::Edit::kDeleteLayer:
      return DeleteLayer{message.delete_layer().layer()};
    case v1::Edit::kSetTransform:
      return DecodeSetTransform(absl::StrCat(field, ".set_transform"), message.set_transform());
    case v1::Edit::EDIT_NOT_SET:
      break;
  }
  return InvalidField(field, "says nothing to do");
}

absl::StatusOr<EditBatch> DecodeEdits(const google::protobuf::RepeatedPtrField<v1::Edit>& edits,
                                      const Limits& limits) {
  if (edits.empty()) return InvalidField("edits", "is empty");
  if (edits.size() > limits.max_edits) {
    return absl::ResourceExhaustedError(
        absl::StrCat("edits has ", edits.size(), ", --max_edits is ", limits.max_edits));
  }
  EditBatch batch;
  batch.edits.reserve(edits.size());
  for (const v1::Edit& message : edits) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(
        Edit edit, DecodeEdit(absl::StrCat("edits[", batch.edits.size(), "]"), message, limits));
    batch.edits.push_back(std::move(edit));
  }
  return batch;
}

absl::StatusOr<std::vector<LayerVersion>> DecodeLayerVersions(
    absl::string_view field, const google::protobuf::RepeatedPtrField<v1::LayerVersion>& messages) {
  std::vector<LayerVersion> versions;
  versions.reserve(messages.size());
  for (const v1::LayerVersion& message : messages) {
    if (message.layer().empty()) {
      return InvalidField(absl::StrCat(field, "[", versions.size(), "].layer"), "is empty");
    }
    versions.push_back({message.layer(), message.version()});
  }
  return versions;
}

std::string EditsToBytes(const EditBatch& batch) {
  v1::ApplyEditsRequest message;
  EncodeLayerVersions(batch.if_layers, message.mutable_if_layers());
  for (const Edit& edit : batch.edits) EncodeEdit(edit, message.add_edits());
  return message.SerializeAsString();
}

absl::StatusOr<EditBatch> EditsFromBytes(absl::string_view bytes) {
  v1::ApplyEditsRequest message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return absl::DataLossError("the bytes are no batch of edits");
  }
  UpgradeFrom01(&message);
  // Limits of size are those of the server, which checks them when the batch is sent.
  Limits none;
  none.max_vertices = std::numeric_limits<int>::max();
  none.max_edits = std::numeric_limits<int>::max();
  none.max_cells = std::numeric_limits<int64_t>::max();
  absl::StatusOr<EditBatch> batch = DecodeEdits(message.edits(), none);
  if (!batch.ok()) return batch;
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerVersion> versions,
                            DecodeLayerVersions("if_layers", message.if_layers()));
  batch->if_layers = std::move(versions);
  return batch;
}

}  // namespace hypermap::wire
