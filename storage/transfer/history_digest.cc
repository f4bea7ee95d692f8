#include "storage/transfer/history_digest.h"

#include <string>
#include <variant>

#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"

namespace hypermap::storage {
namespace {

// Adds which layer a change is of, and the content that its columns only name.
class ChangeContent {
 public:
  explicit ChangeContent(DigestWriter* writer) : writer_(*writer) {}

  void operator()(const LayerCreated& c) { writer_.Add(c.spec); }
  void operator()(const LayerDeleted& c) { writer_.Add(c.spec); }
  void operator()(const TransformSet&) {}
  void operator()(const AliasesSet& c) { AddName(c.layer); }
  void operator()(const ExtentGrown& c) { AddName(c.layer); }
  void operator()(const ObjectPut& c) {
    AddName(c.layer);
    writer_.Add(c.before.get());
    writer_.Add(c.after.get());
  }
  void operator()(const ObjectRemoved& c) {
    AddName(c.layer);
    writer_.Add(c.before.get());
  }
  void operator()(const TileWritten& c) {
    AddName(c.layer);
    writer_.Add(c.index.row);
    writer_.Add(c.index.col);
    writer_.Add(c.before.get());
    writer_.Add(c.after.get());
  }

 private:
  void AddName(const std::string& layer) { writer_.Add(layer); }

  DigestWriter& writer_;
};

}  // namespace

absl::Status AddTo(DigestWriter* writer, const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(const ChangeColumns columns, EncodeChange(change));
  writer->Add(columns.kind);
  writer->Add(columns.detail.has_value());
  if (columns.detail) writer->Add(*columns.detail);
  std::visit(ChangeContent(writer), change);
  return absl::OkStatus();
}

void AddTo(DigestWriter* writer, const LayerStructure& layer) {
  writer->Add(layer.spec);
  writer->Add(layer.extent);
  writer->Add(layer.version);
}

void AddTo(DigestWriter* writer, const LogKey& key) {
  writer->Add(key.after.stamp);
  writer->Add(key.after.robot);
  writer->Add(key.after.sequence);
  writer->Add(key.number);
}

}  // namespace hypermap::storage
