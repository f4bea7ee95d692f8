#include "storage/encoding/change_columns.h"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/encoding/layer_columns.h"

namespace hypermap::storage {
namespace {

using Json = nlohmann::json;

constexpr char kLayerCreated[] = "layer_created";
constexpr char kLayerDeleted[] = "layer_deleted";
constexpr char kAliasesSet[] = "aliases";
constexpr char kExtentGrown[] = "extent";
constexpr char kTransformSet[] = "transform";

// Encodes a change to its columns. nlohmann throws when a text is not UTF-8.
struct ToColumns {
  ChangeColumns operator()(const LayerCreated& c) const { return OfSpec(kLayerCreated, c.spec); }
  ChangeColumns operator()(const LayerDeleted& c) const { return OfSpec(kLayerDeleted, c.spec); }
  ChangeColumns operator()(const TransformSet& c) const {
    const PlanarTransform& t = c.transform.parent_from_child;
    const Json json{{"parent", c.transform.parent_frame_id},
                    {"child", c.transform.child_frame_id},
                    {"x", t.x()},
                    {"y", t.y()},
                    {"yaw", t.yaw()}};
    return {kTransformSet, {}, {}, json.dump()};
  }
  ChangeColumns operator()(const AliasesSet& c) const {
    return {kAliasesSet, {}, {}, Json{{"before", c.before}, {"after", c.after}}.dump()};
  }
  ChangeColumns operator()(const ExtentGrown& c) const {
    const Json json{c.extent.row_begin, c.extent.row_end, c.extent.col_begin, c.extent.col_end};
    return {kExtentGrown, {}, {}, json.dump()};
  }
  ChangeColumns operator()(const ObjectPut& c) const { return {kObjectPut, c.after->id, {}, {}}; }
  ChangeColumns operator()(const ObjectRemoved& c) const {
    return {kObjectRemoved, c.before->id, {}, {}};
  }
  ChangeColumns operator()(const TileWritten& c) const { return {kTileWritten, {}, c.index, {}}; }

  static ChangeColumns OfSpec(const char* kind, const LayerSpec& spec) {
    absl::StatusOr<std::string> parameters = EncodeLayerParameters(spec);
    return {kind, {}, {}, parameters.ok() ? *std::move(parameters) : std::string("{}")};
  }
};

absl::StatusOr<Change> DecodeDetail(absl::string_view kind, absl::string_view detail,
                                    const LayerSpec& layer) {
  if (kind == kLayerCreated || kind == kLayerDeleted) {
    LayerSpec spec = layer;
    spec.aliases.clear();
    HYPERMAP_RETURN_IF_ERROR(DecodeLayerParameters(detail, &spec));
    if (kind == kLayerCreated) return Change(LayerCreated{std::move(spec)});
    return Change(LayerDeleted{std::move(spec)});
  }
  const Json json = Json::parse(detail.begin(), detail.end());
  if (kind == kTransformSet) {
    return Change(TransformSet{
        {json.at("parent").get<std::string>(),
         json.at("child").get<std::string>(),
         {json.at("x").get<double>(), json.at("y").get<double>(), json.at("yaw").get<double>()}}});
  }
  if (kind == kAliasesSet) {
    return Change(AliasesSet{layer.name, json.at("before").get<ValueAliases>(),
                             json.at("after").get<ValueAliases>()});
  }
  if (kind == kExtentGrown) {
    const auto bound = [&json](int i) { return json.at(i).get<int32_t>(); };
    return Change(ExtentGrown{layer.name, {bound(0), bound(1), bound(2), bound(3)}});
  }
  return absl::DataLossError(absl::StrCat("unknown kind ", kind));
}

}  // namespace

absl::StatusOr<ChangeColumns> EncodeChange(const Change& change) {
  try {
    return std::visit(ToColumns(), change);
  } catch (const Json::exception&) {
    return absl::InvalidArgumentError("a name or an alias is not UTF-8");
  }
}

absl::StatusOr<Change> DecodeStructureChange(absl::string_view kind, absl::string_view detail,
                                             const LayerSpec& layer) {
  try {
    return DecodeDetail(kind, detail, layer);
  } catch (const Json::exception& e) {
    return absl::DataLossError(absl::StrCat("detail of ", kind, ": ", e.what()));
  }
}

}  // namespace hypermap::storage
