// maps, map, layers, layer, alias, transforms, transform set.
#include <unistd.h>

#include <cstdio>
#include <initializer_list>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/validators.h"
#include "map/geometry/shape.h"
#include "map/layers/layer_properties.h"

namespace hypermap::cli {
namespace {

// Shows an answer, or returns its error.
template <typename Answer>
absl::Status ShowAnswer(const absl::StatusOr<Answer>& answer, Output& output) {
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  output.Show(*answer);
  return absl::OkStatus();
}

struct MapOptions {
  std::string map;
  std::string frame_id;
  bool yes = false;
};

struct LayerOptions {
  std::string map;
  std::string name;
  std::string kind;
  std::string origin = "0,0,0";
  std::optional<double> resolution_m;
  std::optional<double> free_below;
  std::optional<double> occupied_above;
  std::string frame_id;
  std::string unit;
  std::string explored_rule;
  std::vector<std::string> shapes;
};

struct AliasOptions {
  std::string map;
  std::string layer;
  std::vector<std::string> aliases;
};

struct TransformOptions {
  std::string map;
  std::string child;
  std::string parent;
  std::string x;
  std::string y;
  std::string yaw;
};

// Asks whether the map is to be deleted, if there is a person to answer.
absl::Status ConfirmDeletion(const MapOptions& options, std::istream& in) {
  if (options.yes) return absl::OkStatus();
  if (isatty(STDIN_FILENO) == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("map ", options.map, " is not deleted: --yes is missing"));
  }
  std::fprintf(stderr, "Delete map %s and its layers? [y/N] ", options.map.c_str());
  std::string answer;
  std::getline(in, answer);
  if (answer == "y" || answer == "yes") return absl::OkStatus();
  return absl::CancelledError(absl::StrCat("map ", options.map, " is not deleted"));
}

void AddMapCommands(CLI::App& app, Command& selected) {
  CLI::App* maps = app.add_subcommand("maps", "List the maps");
  maps->callback([&selected] {
    selected = [](Session& s) { return ShowAnswer(s.client.ListMaps(), s.output); };
  });

  CLI::App* map = app.add_subcommand("map", "Create or delete a map")->require_subcommand(1);
  auto options = std::make_shared<MapOptions>();
  CLI::App* create = map->add_subcommand("create", "Create an empty map");
  create->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  create->add_option("--frame", options->frame_id, "Name of the map's own frame (default: map)");
  create->callback([&selected, options] {
    selected = [options](Session& s) {
      HYPERMAP_ASSIGN_OR_RETURN(auto answer, s.client.CreateMap(options->map, options->frame_id));
      s.output.Show(Done{.map = answer.name, .what = "created"});
      return absl::OkStatus();
    };
  });
  CLI::App* remove = map->add_subcommand("delete", "Delete a map and its layers; asks first");
  remove->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  remove->add_flag("--yes", options->yes, "Do not ask; required if the input is no terminal");
  remove->callback([&selected, options] {
    selected = [options](Session& s) {
      HYPERMAP_RETURN_IF_ERROR(ConfirmDeletion(*options, s.in));
      HYPERMAP_RETURN_IF_ERROR(s.client.DeleteMap(options->map));
      s.output.Show(Done{.map = options->map, .what = "deleted"});
      return absl::OkStatus();
    };
  });
}

absl::StatusOr<LayerSpec> MakeSpec(const LayerOptions& options) {
  LayerSpec spec;
  spec.name = options.name;
  spec.kind = ParseLayerKind(options.kind).value_or(LayerKind::kSemantic);
  spec.frame_id = options.frame_id;
  spec.unit = options.unit;
  if (options.free_below) spec.thresholds.free_below = *options.free_below;
  if (options.occupied_above) spec.thresholds.occupied_above = *options.occupied_above;
  if (!options.explored_rule.empty()) {
    if (spec.kind != LayerKind::kExploration) {
      return absl::InvalidArgumentError("--explored_rule is for exploration layers only");
    }
    spec.explored_rule = ParseCellRule(options.explored_rule).value_or(CellRule::kCentre);
  }
  if (!options.shapes.empty()) {
    if (!PropertiesOf(spec).has_shapes) {
      return absl::InvalidArgumentError("--shapes is for layers of objects only");
    }
    spec.shape_kinds = ShapeKinds(std::initializer_list<ShapeKind>());  // none yet
    for (const std::string& shape : options.shapes) {
      if (const std::optional<ShapeKind> kind = ParseShapeKind(shape)) spec.shape_kinds.Add(*kind);
    }
  }
  if (options.resolution_m) {
    HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform origin, ParsePose(options.origin));
    spec.grid = GridGeometry{origin, *options.resolution_m};
  }
  return spec;
}

absl::Status CreateLayer(const LayerOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerSpec spec, MakeSpec(options));
  HYPERMAP_ASSIGN_OR_RETURN(const Revision revision, s.client.CreateLayer(options.map, spec));
  s.output.Show(Done{options.map, "created", options.name, revision});
  return absl::OkStatus();
}

void AddLayerOptions(CLI::App& create, LayerOptions& options) {
  create
      .add_option("--kind", options.kind,
                  "Kind of the layer: occupancy, exploration, semantic or scalar")
      ->required()
      ->check(IsLayerKind());
  CLI::Option* resolution = create.add_option("--resolution", options.resolution_m,
                                              "Side of a cell in metres, for layers of cells");
  create.add_option("--origin", options.origin, "Pose of the lower left corner of cell (0, 0)")
      ->type_name("X,Y,YAW")
      ->needs(resolution)
      ->check(IsPose())
      ->capture_default_str();
  create.add_option("--frame", options.frame_id, "Frame of the layer (default: the map's own)");
  create.add_option("--unit", options.unit, "Unit of the values of a scalar layer");
  create.add_option("--free-below", options.free_below, "Probability below which cells are free");
  create.add_option("--occupied-above", options.occupied_above,
                    "Probability above which cells are occupied");
  create
      .add_option("--shapes,--shape", options.shapes,
                  "Shapes that the objects of a semantic layer may have: polygon, line_string, "
                  "point (default: all)")
      ->type_name("KIND,...")
      ->delimiter(',')
      ->check(IsShapeKind());
  create
      .add_option(
          "--explored_rule,--explored-rule", options.explored_rule,
          "For exploration layers: a cell becomes explored if the free space that a robot "
          "observed contains its centre (centre, the default), covers it completely (covered) "
          "or touches it (touched)")
      ->type_name("RULE")
      ->check(IsCellRule());
}

void AddLayerCommands(CLI::App& app, Command& selected) {
  auto options = std::make_shared<LayerOptions>();
  CLI::App* layers = app.add_subcommand("layers", "List the layers of a map");
  layers->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  layers->callback([&selected, options] {
    selected = [options](Session& s) {
      return ShowAnswer(s.client.ListLayers(options->map), s.output);
    };
  });

  CLI::App* layer = app.add_subcommand("layer", "Create or delete a layer")->require_subcommand(1);
  CLI::App* create = layer->add_subcommand("create", "Create an empty layer");
  create->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  create->add_option("name", options->name, "Name of the layer")->required()->type_name("NAME");
  AddLayerOptions(*create, *options);
  create->callback([&selected, options] {
    selected = [options](Session& s) { return CreateLayer(*options, s); };
  });

  CLI::App* remove = layer->add_subcommand("delete", "Delete a layer and its content");
  remove->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  remove->add_option("name", options->name, "Name of the layer")->required()->type_name("NAME");
  remove->callback([&selected, options] {
    selected = [options](Session& s) {
      HYPERMAP_ASSIGN_OR_RETURN(const Revision revision,
                                s.client.DeleteLayer(options->map, options->name));
      s.output.Show(Done{options->map, "deleted", options->name, revision});
      return absl::OkStatus();
    };
  });
}

// Parses "ALIAS=LABEL,LABEL...". An alias without labels is deleted.
absl::StatusOr<ValueAliases> ParseAliases(const std::vector<std::string>& texts) {
  ValueAliases aliases;
  for (const std::string& text : texts) {
    const std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits('=', 1));
    const std::vector<std::string> labels =
        absl::StrSplit(parts.second, ',', absl::SkipWhitespace());
    if (aliases.contains(parts.first)) {
      return absl::InvalidArgumentError(absl::StrCat("alias \"", parts.first, "\" is given twice"));
    }
    aliases.insert_or_assign(parts.first, {labels.begin(), labels.end()});
  }
  return aliases;
}

absl::Status SetLayerAliases(const AliasOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const ValueAliases aliases, ParseAliases(options.aliases));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto answer, s.client.ApplyEdits(options.map, {{SetAliases{options.layer, aliases}}}));
  s.output.Show(Done{options.map, "aliases set", options.layer, answer.revision});
  return absl::OkStatus();
}

void AddAliasCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<AliasOptions>();
  CLI::App* alias = app.add_subcommand("alias", "Set the aliases of labels in a semantic layer");
  alias->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  alias->add_option("layer", options->layer, "Name of the layer")->required()->type_name("LAYER");
  alias
      ->add_option(
          "aliases", options->aliases,
          "Aliases and their labels (tv=tvmonitor furniture=chair,couch); an alias without "
          "labels (tv=) is deleted, aliases that are not named are kept")
      ->required()
      ->type_name("ALIAS=LABEL,...")
      ->check(IsAlias());
  alias->callback([&selected, options] {
    selected = [options](Session& s) { return SetLayerAliases(*options, s); };
  });
}

absl::Status SetTransform(const TransformOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform pose,
                            ParsePose(options.x + "," + options.y + "," + options.yaw));
  HYPERMAP_ASSIGN_OR_RETURN(
      const Revision revision,
      s.client.SetTransform(options.map, {options.parent, options.child, pose}));
  s.output.Show(
      Done{options.map, "frame " + options.child + " set in " + options.parent, "", revision});
  return absl::OkStatus();
}

void AddTransformCommands(CLI::App& app, Command& selected) {
  auto options = std::make_shared<TransformOptions>();
  CLI::App* transforms = app.add_subcommand("transforms", "List the frames of a map");
  transforms->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  transforms->callback([&selected, options] {
    selected = [options](Session& s) {
      return ShowAnswer(s.client.ListTransforms(options->map), s.output);
    };
  });

  CLI::App* transform =
      app.add_subcommand("transform", "Set or estimate the pose of a frame")->require_subcommand(1);
  CLI::App* set = transform->add_subcommand("set", "Set the pose of a frame in its parent frame");
  set->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  set->add_option("child", options->child, "Frame to place")->required()->type_name("CHILD");
  set->add_option("parent", options->parent, "Parent frame, in which the pose is given")
      ->required()
      ->type_name("PARENT");
  set->add_option("x", options->x, "X coordinate in metres")
      ->required()
      ->type_name("X")
      ->check(IsNumber());
  set->add_option("y", options->y, "Y coordinate in metres")
      ->required()
      ->type_name("Y")
      ->check(IsNumber());
  set->add_option("yaw", options->yaw, "Rotation in radians, counter-clockwise")
      ->required()
      ->type_name("YAW")
      ->check(IsNumber());
  set->callback([&selected, options] {
    selected = [options](Session& s) { return SetTransform(*options, s); };
  });
}

}  // namespace

void AddCatalogCommands(CLI::App& app, Command& selected) {
  AddMapCommands(app, selected);
  AddLayerCommands(app, selected);
  AddAliasCommand(app, selected);
  AddTransformCommands(app, selected);
}

}  // namespace hypermap::cli
