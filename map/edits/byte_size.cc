#include "map/edits/byte_size.h"

#include <string>
#include <variant>

#include "map/structure.h"

namespace hypermap {
namespace {

int64_t Length(const std::string& text) { return static_cast<int64_t>(text.size()); }

// Each returns the bytes beyond sizeof(Edit).
struct EditBytes {
  int64_t operator()(const CreateLayer& edit) const { return ByteSize(edit.spec); }
  int64_t operator()(const DeleteLayer& edit) const { return Length(edit.layer); }
  int64_t operator()(const SetTransform& edit) const {
    return Length(edit.transform.parent_frame_id) + Length(edit.transform.child_frame_id);
  }
  int64_t operator()(const PutObject& edit) const {
    return Length(edit.layer) + Length(edit.frame_id) + ByteSize(edit.object);
  }
  int64_t operator()(const DeleteObject& edit) const { return Length(edit.layer); }
  int64_t operator()(const WriteCells& edit) const {
    return Length(edit.layer) +
           static_cast<int64_t>(edit.values.size() * sizeof edit.values.front());
  }
  int64_t operator()(const FillPolygon& edit) const {
    return Length(edit.layer) + Length(edit.frame_id) + ByteSize(edit.area);
  }
  int64_t operator()(const SetAliases& edit) const {
    return Length(edit.layer) + UnsharedBytes(edit.aliases, {});
  }
};

// Each returns the bytes beyond sizeof(Change).
struct ChangeBytes {
  int64_t operator()(const LayerCreated& change) const { return ByteSize(change.spec); }
  int64_t operator()(const LayerDeleted& change) const { return ByteSize(change.spec); }
  int64_t operator()(const TransformSet& change) const {
    return Length(change.transform.parent_frame_id) + Length(change.transform.child_frame_id);
  }
  int64_t operator()(const ObjectPut& change) const {
    return Length(change.layer) + Bytes(change.before) + Bytes(change.after);
  }
  int64_t operator()(const ObjectRemoved& change) const {
    return Length(change.layer) + Bytes(change.before);
  }
  int64_t operator()(const TileWritten& change) const {
    return Length(change.layer) + Bytes(change.before) + Bytes(change.after);
  }
  int64_t operator()(const ExtentGrown& change) const { return Length(change.layer); }
  int64_t operator()(const AliasesSet& change) const {
    return Length(change.layer) + UnsharedBytes(change.before, {}) +
           UnsharedBytes(change.after, {});
  }

  static int64_t Bytes(const ObjectPtr& object) { return object ? ByteSize(*object) : 0; }
  static int64_t Bytes(const TilePtr& tile) { return tile ? tile->ByteSize() : 0; }
};

}  // namespace

int64_t ByteSize(const Polygon& polygon) {
  return polygon.num_vertices() * static_cast<int64_t>(sizeof(Point)) +
         static_cast<int64_t>(polygon.rings().size() * sizeof(Ring));
}

int64_t ByteSize(const Edit& edit) {
  return static_cast<int64_t>(sizeof edit) + std::visit(EditBytes(), edit);
}

int64_t ByteSize(const EditBatch& batch) {
  int64_t bytes = sizeof batch;
  for (const Edit& edit : batch.edits) bytes += ByteSize(edit);
  for (const LayerVersion& wanted : batch.if_layers) {
    bytes += static_cast<int64_t>(sizeof wanted) + Length(wanted.layer);
  }
  return bytes;
}

int64_t ByteSize(const Change& change) {
  return static_cast<int64_t>(sizeof change) + std::visit(ChangeBytes(), change);
}

}  // namespace hypermap
