#include "storage/transfer/digest_writer.h"

#include <cstring>
#include <optional>
#include <utility>
#include <variant>

#include "absl/base/casts.h"
#include "absl/strings/escaping.h"
#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"
#include "storage/encoding/layer_columns.h"
#include "storage/encoding/object_columns.h"

namespace hypermap::storage {
namespace {

// The values of columns, in their order.
class Columns {
 public:
  explicit Columns(DigestWriter* writer) : writer_(*writer) {}

  Columns& operator<<(const std::string& text) {
    writer_.Add(absl::string_view(text));
    return *this;
  }
  Columns& operator<<(int64_t number) {
    writer_.Add(number);
    return *this;
  }
  Columns& operator<<(double number) {
    // The two zeros are equal to each other.
    writer_.Add(absl::bit_cast<int64_t>(number + 0.0));
    return *this;
  }
  template <typename T>
  Columns& operator<<(const std::optional<T>& value) {
    *this << int64_t{value.has_value()};
    return value ? *this << *value : *this;
  }

 private:
  DigestWriter& writer_;
};

// Adds which layer a change is of, and the content that its columns only name.
class ChangeContent {
 public:
  explicit ChangeContent(DigestWriter* writer) : writer_(*writer) {}

  absl::Status operator()(const LayerCreated& c) { return Named(c.spec); }
  absl::Status operator()(const LayerDeleted& c) { return Named(c.spec); }
  absl::Status operator()(const TransformSet&) { return absl::OkStatus(); }
  absl::Status operator()(const AliasesSet& c) { return Named(c.layer); }
  absl::Status operator()(const ExtentGrown& c) { return Named(c.layer); }
  absl::Status operator()(const ObjectPut& c) {
    HYPERMAP_RETURN_IF_ERROR(Named(c.layer));
    HYPERMAP_RETURN_IF_ERROR(writer_.Add(c.before.get()));
    return writer_.Add(c.after.get());
  }
  absl::Status operator()(const ObjectRemoved& c) {
    HYPERMAP_RETURN_IF_ERROR(Named(c.layer));
    return writer_.Add(c.before.get());
  }
  absl::Status operator()(const TileWritten& c) {
    HYPERMAP_RETURN_IF_ERROR(Named(c.layer));
    writer_.Add(int64_t{c.index.row});
    writer_.Add(int64_t{c.index.col});
    writer_.Add(c.before.get());
    writer_.Add(c.after.get());
    return absl::OkStatus();
  }

 private:
  absl::Status Named(const std::string& layer) {
    writer_.Add(absl::string_view(layer));
    return absl::OkStatus();
  }
  absl::Status Named(const LayerSpec& spec) { return writer_.Add(LayerStructure{spec, {}, 0}); }

  DigestWriter& writer_;
};

}  // namespace

void DigestWriter::Add(int64_t number) {
  char bytes[sizeof number];
  auto rest = static_cast<uint64_t>(number);
  for (char& byte : bytes) {
    byte = static_cast<char>(rest & 0xff);
    rest >>= 8;
  }
  digest_.Add(absl::string_view(bytes, sizeof bytes));
}

void DigestWriter::Add(absl::string_view text) {
  Add(static_cast<int64_t>(text.size()));
  digest_.Add(text);
}

absl::Status DigestWriter::Add(const SemanticObject* object) {
  Add(int64_t{object != nullptr});
  if (object == nullptr) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const EncodedObject encoded, EncodeObject(*object));
  Columns(this) << object->id << object->version << object->label << object->existence
                << encoded.shape << encoded.classes << encoded.tags << encoded.attributes
                << encoded.height_min << encoded.height_max << encoded.expires_at_ns;
  return absl::OkStatus();
}

void DigestWriter::Add(const Tile* tile) {
  Add(int64_t{tile != nullptr});
  if (tile == nullptr) return;
  TileCodes codes = tile->codes();
  for (CellCode& code : codes) code = IsUnknown(code) ? kUnknownCode : code + 0.0f;
  digest_.Add(absl::string_view(reinterpret_cast<const char*>(codes.data()), sizeof codes));
}

absl::Status DigestWriter::Add(const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(const ChangeColumns columns, EncodeChange(change));
  Add(absl::string_view(columns.kind));
  Columns(this) << columns.detail;
  return std::visit(ChangeContent(this), change);
}

absl::Status DigestWriter::Add(const LayerStructure& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerColumns columns, EncodeLayer(layer.spec, layer.extent));
  const ExtentColumns& extent = columns.extent;
  Columns(this) << columns.name << columns.kind << columns.frame_id << columns.origin_x
                << columns.origin_y << columns.origin_yaw << columns.resolution_m
                << extent.row_begin << extent.row_end << extent.col_begin << extent.col_end
                << columns.parameters << layer.version;
  return absl::OkStatus();
}

void DigestWriter::Add(const FrameTree& frames) {
  const auto& transforms = frames.transforms();
  Add(static_cast<int64_t>(transforms.size()));
  for (const FrameTransform& transform : transforms) {
    const PlanarTransform& pose = transform.parent_from_child;
    Columns(this) << transform.parent_frame_id << transform.child_frame_id << pose.x() << pose.y()
                  << pose.yaw();
  }
}

void DigestWriter::Add(const LogKey& key) {
  Add(key.after.stamp);
  Add(absl::string_view(key.after.robot));
  Add(key.after.sequence);
  Add(key.number);
}

std::string DigestWriter::Finish() && {
  return absl::BytesToHexString(std::move(digest_).Finish());
}

}  // namespace hypermap::storage
