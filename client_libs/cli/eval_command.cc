// eval.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/eval_image.h"
#include "client_libs/cli/eval_truth.h"
#include "client_libs/cli/file_io.h"

namespace hypermap::cli {
namespace {

struct EvalOptions {
  std::string map;
  std::string layer;
  std::string truth_path;
  std::string truth_map;
  std::string truth_layer;
  int min_visible_frames = 5;
  std::string image_path;
};

// Objects of a layer on the server, in some frame, and the revision at which they were read.
struct LiveObjects {
  Revision revision = 0;
  std::vector<SemanticObject> objects;
};

absl::StatusOr<LiveObjects> ReadLayer(client::Client& client, const std::string& map,
                                      const std::string& layer, const std::string& frame_id) {
  client::AnswerReader reader = client.QueryArea(map, Everywhere(), {{layer}, frame_id});
  LiveObjects live;
  while (std::optional<client::LayerPart> part = reader.Next()) {
    if (!PropertiesOfKind(part->kind).has_shapes) {
      return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is of the kind ",
                                                        LayerKindName(part->kind),
                                                        ", which holds no objects"));
    }
    if (part->status != AnswerStatus::kValue) {
      return absl::FailedPreconditionError(
          absl::StrCat("layer \"", layer, "\" has no transform to the frame ",
                       frame_id.empty() ? "of the map" : absl::StrCat("\"", frame_id, "\"")));
    }
    for (SemanticObject& object : part->objects) live.objects.push_back(std::move(object));
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  live.revision = reader.revision();
  return live;
}

// Reads the ground truth from a file or from a layer on the server.
absl::StatusOr<PlacedObjects> GetTruth(const EvalOptions& options, client::Client& client) {
  if (!options.truth_path.empty()) return ReadTruth(options.truth_path, options.truth_layer);
  const std::string& layer = options.truth_layer.empty() ? options.layer : options.truth_layer;
  HYPERMAP_ASSIGN_OR_RETURN(LiveObjects live, ReadLayer(client, options.truth_map, layer, ""));
  return PlacedObjects{"", std::move(live.objects)};
}

absl::Status Eval(const EvalOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const PlacedObjects all_truth, GetTruth(options, s.client));
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerEntry layer,
                            s.client.GetLayer(options.map, options.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const LiveObjects live,
                            ReadLayer(s.client, options.map, options.layer, all_truth.frame_id));

  EvaluationReport report{options.map, options.layer, live.revision};
  report.truth = options.truth_path.empty() ? options.truth_map : options.truth_path;
  report.image = options.image_path;
  const ValueAliases& aliases = layer.spec.aliases;
  std::vector<evaluation::Object> truth, map;
  for (const SemanticObject& object : all_truth.objects) {
    if (!object.shape.is_polygon()) {
      ++report.truth_not_polygons;
    } else if (!Counts(object, options.min_visible_frames)) {
      ++report.truth_ignored;
    } else {
      truth.push_back(ToEvaluate(object, aliases));
    }
  }
  for (const SemanticObject& object : live.objects) {
    if (object.shape.is_polygon()) {
      map.push_back(ToEvaluate(object, aliases));
    } else {
      ++report.map_not_polygons;
    }
  }
  report.evaluation = evaluation::Evaluate(truth, map);
  if (!options.image_path.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::string png, DrawEvaluation(truth, map, report.evaluation));
    HYPERMAP_RETURN_IF_ERROR(WriteFile(options.image_path, png));
  }
  s.output.Show(report);
  return absl::OkStatus();
}

}  // namespace

void AddEvalCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<EvalOptions>();
  CLI::App* eval = app.add_subcommand(
      "eval", "Compare the objects of a layer with ground truth; ignores line strings and points");
  eval->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  eval->add_option("--layer", options->layer, "Semantic layer to evaluate")->required();
  CLI::Option_group* truth = eval->add_option_group("truth", "Ground truth (one of these)");
  truth->add_option("--truth", options->truth_path, "Ground truth in a .geojson or .hmap file")
      ->type_name("FILE");
  truth
      ->add_option("--truth-map,--truth_map", options->truth_map,
                   "Ground truth in a map of the server")
      ->type_name("MAP");
  truth->require_option(1);
  eval->add_option("--truth-layer,--truth_layer", options->truth_layer,
                   "Layer with the ground truth, in the map or in an .hmap file of several layers "
                   "(default for a map: as --layer)")
      ->type_name("LAYER");
  eval->add_option("--min-visible-frames,--min_visible_frames", options->min_visible_frames,
                   "Ignore ground truth objects with a lower value of the property visible_frames")
      ->capture_default_str();
  eval->add_option("--png", options->image_path,
                   "Also draw the layer over the ground truth, as a PNG image")
      ->type_name("FILE");
  eval->callback(
      [&selected, options] { selected = [options](Session& s) { return Eval(*options, s); }; });
}

}  // namespace hypermap::cli
