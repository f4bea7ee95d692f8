#include "ingest/worker/target_options.h"

#include "ingest/perception/pcl/region_growing_segmenter.h"
#include "ingest/perception/pose_sigma.h"

namespace hypermap::ingest {

void AddTargetOptions(CLI::App& command, TargetLayer& target) {
  client::AddConnectionFlags(command, target.connection);
  command.add_option("--map", target.map, "Name of the map; created if there is none")->required();
  command
      .add_option("--layer", target.layer,
                  "Semantic layer for the objects; created if there is none")
      ->capture_default_str();
  command
      .add_option("--exploration", target.exploration_layer,
                  "Layer in which observed floor is marked as explored; created if there is none")
      ->type_name("LAYER");
  command
      .add_option("--fusion", target.strategy,
                  "Fusion strategy (default: that of the layer, evidence for a new one)")
      ->check(CLI::IsMember({"evidence", "paper"}));
  command
      .add_option("--parameters", target.parameters,
                  "Parameters of the fusion strategy, a JSON object of numbers")
      ->type_name("JSON");
}

CLI::Validator IsPoseSigma() {
  return CLI::Validator(
      [](std::string& text) { return std::string(ParsePoseSigma(text).status().message()); },
      "X,Y,YAW");
}

void AddSegmenterOption(CLI::App& command, std::string& segmenter) {
  command
      .add_option("--segmenter", segmenter, "Method that removes the background from detections")
      ->check(CLI::IsMember({"organised", "region_growing"}))
      ->capture_default_str();
}

std::unique_ptr<Segmenter> MakeSegmenter(const std::string& name) {
  return name == "region_growing" ? MakeRegionGrowingSegmenter() : MakeOrganisedSegmenter();
}

}  // namespace hypermap::ingest
