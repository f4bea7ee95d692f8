// transform estimate.
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/as_of.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/file_io.h"
#include "client_libs/cli/point_pairs_file.h"
#include "client_libs/cli/transform_image.h"
#include "client_libs/cli/transform_tables.h"
#include "client_libs/cli/validators.h"

namespace hypermap::cli {
namespace {

using registration::Ambiguity;
using registration::ReadSide;

// Exit codes of the command besides 0.
constexpr int kExitAmbiguous = 1;
constexpr int kExitNoEstimate = 2;

struct SideOptions {
  std::string map;
  std::string layer;
  std::string frame_id;
  std::string at;
};

struct EstimateOptions {
  SideOptions source;
  SideOptions target;
  std::string layer;  // of both sides
  std::string pairs_path;
  std::string image_path;
  bool apply = false;
  bool force = false;
  std::string child;
};

const std::string& LayerOf(const EstimateOptions& options, const SideOptions& side) {
  return side.layer.empty() ? options.layer : side.layer;
}

// With pairs the layers are only drawn.
client::TransformSide SideOf(const EstimateOptions& options, const SideOptions& side) {
  client::TransformSide asked;
  asked.map = side.map;
  if (options.pairs_path.empty()) asked.layer = LayerOf(options, side);
  asked.frame_id = side.frame_id;
  if (const absl::StatusOr<AsOf> at = ParseAsOf(side.at); at.ok()) asked.as_of = *at;
  return asked;
}

absl::StatusOr<std::vector<client::NamedPair>> ReadPairs(const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  absl::StatusOr<std::vector<client::NamedPair>> pairs = ReadPointPairs(text);
  if (!pairs.ok()) {
    return absl::Status(pairs.status().code(), absl::StrCat(path, ": ", pairs.status().message()));
  }
  if (pairs->empty()) return absl::InvalidArgumentError(absl::StrCat(path, ": has no pairs"));
  return pairs;
}

// Adds the content of a layer to a scene, and returns the kind of the layer.
absl::StatusOr<LayerKind> ReadContent(client::AnswerReader reader, TransformSideScene* scene) {
  LayerKind kind = LayerKind::kSemantic;
  while (std::optional<client::LayerPart> part = reader.Next()) {
    kind = part->kind;
    if (part->grid) scene->grid = part->grid;
    scene->runs.insert(scene->runs.end(), part->runs.begin(), part->runs.end());
    for (SemanticObject& object : part->objects) scene->shapes.push_back(std::move(object.shape));
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return kind;
}

// Asks for what was compared, at the revision at which it was. Of a grid that is laid over the
// other only the walls are drawn.
absl::StatusOr<TransformSideScene> ReadScene(client::Client& client, const ReadSide& side,
                                             const std::string& layer, bool walls_only) {
  const std::string name = layer.empty() ? side.map : absl::StrCat(side.map, "/", layer);
  TransformSideScene scene{.name = name};
  if (layer.empty()) return scene;
  client::CallOptions call;
  call.as_of = {.revision = side.revision};
  call.incarnation = side.incarnation;
  const Scope scope{{layer}, side.frame_id};
  if (walls_only) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const LayerKind kind,
        ReadContent(client.QueryValue(side.map, "occupied", std::nullopt, scope, call), &scene));
    if (PropertiesOfKind(kind).has_cells) return scene;
    scene = {.name = name};
  }
  HYPERMAP_RETURN_IF_ERROR(
      ReadContent(client.QueryArea(side.map, Everywhere(), scope, call), &scene).status());
  return scene;
}

// What the picture's legend tells of the estimate.
std::vector<std::string> NotesOf(const registration::TransformEstimate& estimate) {
  const PlanarTransform& pose = estimate.best.target_from_source;
  std::vector<std::string> notes = {
      absl::StrFormat("x %.3f m, y %.3f m, yaw %.2f°", pose.x(), pose.y(),
                      pose.yaw() * 180.0 / M_PI),
      absl::StrFormat("score %.2f, %.0f %% agrees", estimate.best.score,
                      100.0 * estimate.inlier_share)};
  if (estimate.runner_up) {
    notes.push_back(absl::StrFormat("runner-up: score %.2f", estimate.runner_up->score));
  }
  notes.push_back(DescribeAmbiguity(estimate.ambiguity));
  return notes;
}

absl::Status Draw(const EstimateOptions& options, const TransformReport& report,
                  client::Client& client) {
  const registration::TransformEstimate& estimate = report.answer.estimate;
  TransformScene scene;
  HYPERMAP_ASSIGN_OR_RETURN(
      scene.source, ReadScene(client, report.answer.source, LayerOf(options, options.source),
                              /*walls_only=*/true));
  HYPERMAP_ASSIGN_OR_RETURN(
      scene.target, ReadScene(client, report.answer.target, LayerOf(options, options.target),
                              /*walls_only=*/false));
  for (const client::NamedPair& pair : report.pairs) {
    scene.pairs.push_back({pair.pair.source, pair.pair.target, /*agrees=*/false});
  }
  if (!report.pairs.empty()) {
    for (const auto& agreeing : estimate.agreeing) scene.pairs[agreeing.source].agrees = true;
  }
  scene.target_from_source = estimate.best.target_from_source;
  scene.notes = NotesOf(estimate);
  HYPERMAP_ASSIGN_OR_RETURN(const MapImage image, DrawTransform(scene));
  return WriteFile(options.image_path, image.png);
}

// The name that the source's frame gets in the target's map.
absl::StatusOr<std::string> ChildOf(const EstimateOptions& options, const ReadSide& source,
                                    const ReadSide& target) {
  if (!options.child.empty()) return options.child;
  if (source.frame_id != target.frame_id) return source.frame_id;
  if (source.map != target.map) return source.map;
  return absl::InvalidArgumentError(
      absl::StrCat("both sides have the frame \"", source.frame_id,
                   "\" of one map: name the frame to set with --child"));
}

absl::Status Apply(const EstimateOptions& options, TransformReport* report,
                   client::Client& client) {
  const ReadSide& target = report->answer.target;
  const Ambiguity ambiguity = report->answer.estimate.ambiguity;
  if (ambiguity != Ambiguity::kNone && !options.force) {
    return absl::FailedPreconditionError(absl::StrCat("not applied: ", DescribeAmbiguity(ambiguity),
                                                      " (--force applies it nevertheless)"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::string child,
                            ChildOf(options, report->answer.source, target));
  const FrameTransform transform{target.frame_id, child,
                                 report->answer.estimate.best.target_from_source};
  client::CallOptions call;
  call.incarnation = target.incarnation;
  HYPERMAP_ASSIGN_OR_RETURN(report->applied_revision,
                            client.SetTransform(target.map, transform, call));
  report->applied = transform;
  return absl::OkStatus();
}

absl::Status CheckOptions(const EstimateOptions& options) {
  const bool has_layers =
      !LayerOf(options, options.source).empty() && !LayerOf(options, options.target).empty();
  if (has_layers || !options.pairs_path.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "nothing to compare: name the layers (--layer, or --source_layer and --target_layer) or a "
      "file of pairs (--pairs)");
}

absl::Status Estimate(const EstimateOptions& options, Session& s) {
  s.failure_code = kExitNoEstimate;
  HYPERMAP_RETURN_IF_ERROR(CheckOptions(options));
  TransformReport report;
  if (!options.pairs_path.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(report.pairs, ReadPairs(options.pairs_path));
  }
  const client::TransformSide source = SideOf(options, options.source);
  const client::TransformSide target = SideOf(options, options.target);
  HYPERMAP_ASSIGN_OR_RETURN(
      report.answer, report.pairs.empty()
                         ? s.client.EstimateTransform(source, target)
                         : s.client.EstimateTransformFromPairs(source, target, report.pairs));
  if (!options.image_path.empty()) {
    HYPERMAP_RETURN_IF_ERROR(Draw(options, report, s.client));
    report.image = options.image_path;
  }
  const bool is_ambiguous = report.answer.estimate.ambiguity != Ambiguity::kNone;
  absl::Status applied;
  if (options.apply) applied = Apply(options, &report, s.client);
  s.output.Show(report);
  if (is_ambiguous && !report.applied) s.exit_code = s.failure_code = kExitAmbiguous;
  return applied;
}

void AddSide(CLI::App& estimate, const std::string& name, SideOptions& side) {
  estimate.add_option(name, side.map, absl::StrCat("Name of the ", name, " map"))
      ->required()
      ->type_name(name == "source" ? "SOURCE" : "TARGET");
  const auto add = [&](const std::string& what, std::string& value, const std::string& help) {
    return estimate.add_option(absl::StrCat("--", name, "_", what, ",--", name, "-", what), value,
                               help);
  };
  add("layer", side.layer, absl::StrCat("Layer of the ", name))->type_name("LAYER");
  add("frame", side.frame_id,
      absl::StrCat("Frame of the ", name, " of which the transform is estimated (default: its ",
                   "map's own)"))
      ->type_name("FRAME");
  add("at", side.at, absl::StrCat("Read the ", name, " as of a revision or a time"))
      ->type_name("REVISION|TIME")
      ->check(IsAsOf());
}

}  // namespace

void AddEstimateCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<EstimateOptions>();
  CLI::App* estimate = app.get_subcommand("transform")
                           ->add_subcommand("estimate",
                                            "Estimate the transform that lays a map over another "
                                            "one; exits with 1 if it is ambiguous");
  AddSide(*estimate, "source", options->source);
  AddSide(*estimate, "target", options->target);
  estimate
      ->add_option("--layer", options->layer,
                   "Layer of both maps: occupancy grids, or objects. With --pairs it is only drawn")
      ->type_name("LAYER");
  estimate
      ->add_option("--pairs", options->pairs_path,
                   "Estimate from pairs of points instead: a file with a line "
                   "NAME,SOURCE_X,SOURCE_Y,TARGET_X,TARGET_Y for each, in metres")
      ->type_name("FILE");
  estimate
      ->add_option("--output,-o", options->image_path,
                   "Also draw the source over the target, as a PNG image")
      ->type_name("FILE");
  CLI::Option* apply =
      estimate->add_flag("--apply", options->apply,
                         "Set the source's frame in the target map, unless it is ambiguous");
  estimate->add_flag("--force", options->force, "Apply it even if it is ambiguous")->needs(apply);
  estimate
      ->add_option("--child", options->child,
                   "Name of the source's frame in the target map (default: its own name, or that "
                   "of the source map if both frames have the same)")
      ->type_name("FRAME")
      ->needs(apply);
  estimate->callback(
      [&selected, options] { selected = [options](Session& s) { return Estimate(*options, s); }; });
}

}  // namespace hypermap::cli
