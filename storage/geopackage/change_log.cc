#include "storage/geopackage/change_log.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

using Json = nlohmann::json;

constexpr char kLayerCreated[] = "layer_created";
constexpr char kLayerDeleted[] = "layer_deleted";
constexpr char kAliasesSet[] = "aliases";
constexpr char kExtentGrown[] = "extent";
constexpr char kTransformSet[] = "transform";

constexpr char kInsertObjectChange[] =
    "INSERT INTO hypermap_changes (revision, number, kind, lineage, object_id) "
    "VALUES (?, ?, ?, ?, ?)";

struct Columns {
  const char* kind = nullptr;
  std::optional<int64_t> object_id;
  std::optional<MatrixTile> tile;
  std::optional<std::string> detail;
};

// Encodes a change to its columns. nlohmann throws when a text is not UTF-8.
struct ToColumns {
  Columns operator()(const LayerCreated& c) const { return OfSpec(kLayerCreated, c.spec); }
  Columns operator()(const LayerDeleted& c) const { return OfSpec(kLayerDeleted, c.spec); }
  Columns operator()(const TransformSet& c) const {
    const PlanarTransform& t = c.transform.parent_from_child;
    const Json json{{"parent", c.transform.parent_frame_id},
                    {"child", c.transform.child_frame_id},
                    {"x", t.x()},
                    {"y", t.y()},
                    {"yaw", t.yaw()}};
    return {kTransformSet, {}, {}, json.dump()};
  }
  Columns operator()(const AliasesSet& c) const {
    return {kAliasesSet, {}, {}, Json{{"before", c.before}, {"after", c.after}}.dump()};
  }
  Columns operator()(const ExtentGrown& c) const {
    const Json json{c.extent.row_begin, c.extent.row_end, c.extent.col_begin, c.extent.col_end};
    return {kExtentGrown, {}, {}, json.dump()};
  }
  Columns operator()(const ObjectPut& c) const { return {kObjectPut, c.after->id, {}, {}}; }
  Columns operator()(const ObjectRemoved& c) const {
    return {kObjectRemoved, c.before->id, {}, {}};
  }
  Columns operator()(const TileWritten& c) const {
    return {kTileWritten, {}, ToMatrix(c.index), {}};
  }

  static Columns OfSpec(const char* kind, const LayerSpec& spec) {
    absl::StatusOr<std::string> parameters = EncodeLayerParameters(spec);
    return {kind, {}, {}, parameters.ok() ? *std::move(parameters) : std::string("{}")};
  }
};

absl::StatusOr<Columns> Encode(const Change& change) {
  try {
    return std::visit(ToColumns(), change);
  } catch (const Json::exception&) {
    return absl::InvalidArgumentError("a name or an alias is not UTF-8");
  }
}

absl::StatusOr<Change> DecodeDetail(const LoggedChange& logged, const StoredLayer& layer) {
  if (logged.kind == kLayerCreated || logged.kind == kLayerDeleted) {
    LayerSpec spec = layer.spec;
    spec.aliases.clear();
    HYPERMAP_RETURN_IF_ERROR(DecodeLayerParameters(logged.detail, &spec));
    if (logged.kind == kLayerCreated) return Change(LayerCreated{std::move(spec)});
    return Change(LayerDeleted{std::move(spec)});
  }
  const Json json = Json::parse(logged.detail);
  if (logged.kind == kTransformSet) {
    return Change(TransformSet{
        {json.at("parent").get<std::string>(),
         json.at("child").get<std::string>(),
         {json.at("x").get<double>(), json.at("y").get<double>(), json.at("yaw").get<double>()}}});
  }
  if (logged.kind == kAliasesSet) {
    return Change(AliasesSet{layer.spec.name, json.at("before").get<ValueAliases>(),
                             json.at("after").get<ValueAliases>()});
  }
  if (logged.kind == kExtentGrown) {
    const auto bound = [&json](int i) { return json.at(i).get<int32_t>(); };
    return Change(ExtentGrown{layer.spec.name, {bound(0), bound(1), bound(2), bound(3)}});
  }
  return absl::DataLossError(absl::StrCat("unknown kind ", logged.kind));
}

}  // namespace

absl::Status InsertChange(Database* database, Revision revision, int64_t number,
                          std::optional<int64_t> lineage, const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(const Columns columns, Encode(change));
  std::optional<int64_t> tile_column;
  std::optional<int64_t> tile_row;
  if (columns.tile) {
    tile_column = columns.tile->column;
    tile_row = columns.tile->row;
  }
  return database->Run(
      "INSERT INTO hypermap_changes (revision, number, kind, lineage, object_id, tile_column, "
      "tile_row, detail) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      revision, number, columns.kind, lineage, columns.object_id, tile_column, tile_row,
      columns.detail);
}

absl::Status InsertObjectPuts(Database* database, Revision revision, int64_t number,
                              int64_t lineage, absl::Span<const SemanticObject* const> objects) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement insert, database->Prepare(kInsertObjectChange));
  for (const SemanticObject* object : objects) {
    HYPERMAP_RETURN_IF_ERROR(
        insert.Bind(revision, number++, kObjectPut, lineage, object->id).Run());
  }
  return absl::OkStatus();
}

absl::StatusOr<LoggedChange> ReadLoggedChange(Statement* row) {
  LoggedChange change;
  change.revision = row->Int64(0);
  change.kind = std::string(row->Text(1));
  change.lineage = row->OptionalInt64(2).value_or(0);
  change.object_id = row->OptionalInt64(3).value_or(0);
  change.tile.column = row->OptionalInt64(4).value_or(0);
  change.tile.row = row->OptionalInt64(5).value_or(0);
  if (!row->IsNull(6)) change.detail = std::string(row->Text(6));
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return change;
}

absl::StatusOr<Change> DecodeStructureChange(const LoggedChange& logged, const StoredLayer& layer) {
  try {
    return DecodeDetail(logged, layer);
  } catch (const Json::exception& e) {
    return absl::DataLossError(absl::StrCat("detail of ", logged.kind, ": ", e.what()));
  }
}

}  // namespace hypermap::storage
