// import, edit, export, backup, restore.
#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/feature_edits.h"
#include "client_libs/cli/file_formats.h"
#include "client_libs/cli/file_io.h"
#include "client_libs/cli/nav2_files.h"
#include "client_libs/cli/validators.h"
#include "client_libs/ros2/recording/history.h"

namespace hypermap::cli {
namespace {

struct ImportCommand {
  std::string path;
  std::string map;
  std::string format_name;
  client::FileFormat format = client::FileFormat::kGeoJson;
  client::ImportOptions options;
};

struct EditCommand {
  std::string path;
  std::string map;
  std::string layer;
  std::string time_to_live;
  EditConditions conditions;
};

struct ExportCommand {
  std::string map;
  std::string path;
  std::string format_name;
  std::string image;
  ExportFormat format;
  client::ExportOptions options;
  ros2::HistoryOptions history;  // for MCAP
};

struct RestoreCommand {
  std::string path;
  std::string map;
  bool replace = false;
};

// Returns the value. An error here is an error of usage.
template <typename T>
T ValueOrUsageError(absl::StatusOr<T> value) {
  if (!value.ok()) throw CLI::ValidationError(std::string(value.status().message()));
  return *std::move(value);
}

absl::StatusOr<std::vector<client::NamedFile>> ReadFiles(const std::string& path,
                                                         client::FileFormat format) {
  if (format == client::FileFormat::kNav2) return ReadNav2Files(path);
  HYPERMAP_ASSIGN_OR_RETURN(std::string data, ReadFile(path));
  return std::vector<client::NamedFile>{{std::filesystem::path(path).filename(), std::move(data)}};
}

absl::Status Import(const ImportCommand& command, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto files, ReadFiles(command.path, command.format));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto answer, s.client.ImportMap(command.map, command.format, files, command.options));
  s.output.Show(answer);
  return absl::OkStatus();
}

// Sends the file for the server to read, as an import. Used for edits without conditions.
absl::Status EditByFile(const EditCommand& command, Session& s) {
  ImportCommand import;
  import.path = command.path;
  import.map = command.map;
  import.options.layer = command.layer;
  import.options.create_map = false;
  return Import(import, s);
}

absl::Status EditOnConditions(const EditCommand& command, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string data, ReadFile(command.path));
  HYPERMAP_ASSIGN_OR_RETURN(const client::MapEntry map, s.client.GetMap(command.map));
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerEntry layer,
                            s.client.GetLayer(command.map, command.layer));
  HYPERMAP_ASSIGN_OR_RETURN(FeatureEdits edits,
                            ReadFeatureEdits(data, layer.spec, map.frame_id, command.conditions));
  HYPERMAP_ASSIGN_OR_RETURN(const client::EditAnswer answer,
                            s.client.ApplyEdits(command.map, edits.batch));
  s.output.Show(client::ImportAnswer{
      command.map, answer.revision, {command.layer}, std::move(edits.repairs)});
  return absl::OkStatus();
}

absl::Status Backup(const std::string& map, const std::string& path, Session& s) {
  client::ByteReader reader = s.client.BackupMap(map);
  // The first piece shows that the map exists, before a file is created.
  std::optional<std::string> piece = reader.Next();
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<OutputFile> file, OutputFile::Create(path));
  for (; piece.has_value(); piece = reader.Next()) {
    HYPERMAP_RETURN_IF_ERROR(file->Append(*piece));
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  HYPERMAP_RETURN_IF_ERROR(file->Commit());
  s.output.Show(WrittenFiles{.map = map, .paths = {path}});
  return absl::OkStatus();
}

absl::Status Restore(const RestoreCommand& command, Session& s) {
  std::ifstream file(command.path, std::ios::binary);
  if (!file) return absl::ErrnoToStatus(errno, command.path);
  HYPERMAP_ASSIGN_OR_RETURN(const client::MapEntry map,
                            s.client.RestoreMap(command.map, file, command.replace));
  s.output.Show(Done{map.name, "restored", "", map.revision});
  return absl::OkStatus();
}

// Renames the files of an export to the names that the command line asks for.
absl::StatusOr<std::vector<client::NamedFile>> NameFiles(client::FileFormat format,
                                                         std::vector<client::NamedFile> files,
                                                         const std::string& path) {
  if (format == client::FileFormat::kNav2) return RenameNav2Files(files, path);
  if (files.size() != 1) return absl::InternalError("expected one file in the export");
  files.front().name = path;
  return files;
}

absl::Status ExportHistory(const ExportCommand& command, Session& s) {
  ros2::HistoryOptions options = command.history;
  options.map = command.map;
  options.layers = command.options.layers;
  options.timeout = s.timeout;
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<OutputFile> file, OutputFile::Create(command.path));
  HYPERMAP_ASSIGN_OR_RETURN(
      const ros2::RecordedHistory history,
      ros2::RecordHistory(s.client, options,
                          [&file](absl::string_view bytes) { return file->Append(bytes); }));
  HYPERMAP_RETURN_IF_ERROR(file->Commit());
  WrittenFiles written{command.map, history.to, {command.path}, {}};
  // Nobody misses the empty map before revision 1.
  const Revision first = std::max<Revision>(history.oldest, 1);
  if (!options.from && history.from > first) {
    written.omissions.push_back(absl::StrCat("revisions ", first, " to ", history.from - 1,
                                             ", whose layers and frames are not known any more"));
  }
  s.output.Show(written);
  return absl::OkStatus();
}

absl::Status Export(const ExportCommand& command, Session& s) {
  if (std::holds_alternative<Mcap>(command.format)) return ExportHistory(command, s);
  const auto* format = std::get_if<client::FileFormat>(&command.format);
  if (format == nullptr) return Backup(command.map, command.path, s);
  HYPERMAP_ASSIGN_OR_RETURN(auto answer, s.client.ExportMap(command.map, *format, command.options));
  HYPERMAP_ASSIGN_OR_RETURN(const auto files,
                            NameFiles(*format, std::move(answer.files), command.path));
  WrittenFiles written{answer.map, answer.revision, {}, answer.omissions};
  for (const client::NamedFile& file : files) {
    HYPERMAP_RETURN_IF_ERROR(WriteFile(file.name, file.data));
    written.paths.push_back(file.name);
  }
  s.output.Show(written);
  return absl::OkStatus();
}

// Adds the options that are for MCAP only, and returns them.
std::vector<CLI::Option*> AddHistoryOptions(CLI::App& exporting, ros2::HistoryOptions& history) {
  return {
      exporting
          .add_option("--from", history.from,
                      "For mcap: first revision (default: the oldest that is kept)")
          ->type_name("REVISION")
          ->check(CLI::NonNegativeNumber),
      exporting.add_option("--to", history.to, "For mcap: last revision (default: the newest)")
          ->type_name("REVISION")
          ->check(CLI::NonNegativeNumber),
      exporting
          .add_option("--occupancy", history.recorder.occupancy_layer,
                      "For mcap: layer of the topic /map (default: the first occupancy layer)")
          ->type_name("LAYER"),
      exporting
          .add_option("--whole_grid_cells,--whole-grid-cells", history.recorder.whole_grid_cells,
                      "For mcap: a grid with at most so many cells is written whole whenever "
                      "it changes, of a larger one mostly the cells that change")
          ->type_name("NUMBER")
          ->check(CLI::NonNegativeNumber)
          ->capture_default_str()};
}

void AddImport(CLI::App& app, Command& selected) {
  auto command = std::make_shared<ImportCommand>();
  CLI::App* read = app.add_subcommand("import", "Import a file into a map");
  read->add_option("file", command->path, "File to import; for a nav2 map, its YAML file")
      ->required()
      ->type_name("FILE");
  read->add_option("--map", command->map, "Map to import into; created if there is none")
      ->required();
  read->add_option("--layer", command->options.layer,
                   "Layer to write, for GeoJSON and nav2 (default for nav2: occupancy)");
  read->add_option("--frame", command->options.frame_id,
                   "Frame of the layer, for nav2 (default: the map's own)");
  read->add_option("--format", command->format_name,
                   "Format: hmap, nav2 or geojson (default: by the file's extension)");
  read->callback([&selected, command] {
    command->format = ValueOrUsageError(ImportFormatOf(command->format_name, command->path));
    selected = [command](Session& s) { return Import(*command, s); };
  });
}

void AddEdit(CLI::App& app, Command& selected) {
  auto command = std::make_shared<EditCommand>();
  CLI::App* edit = app.add_subcommand("edit",
                                      "Apply the features of a GeoJSON file (polygons, line "
                                      "strings, points) to a layer, all or none");
  edit->add_option("map", command->map, "Name of the map")->required()->type_name("MAP");
  edit->add_option("file", command->path, "GeoJSON file")->required()->type_name("FILE");
  edit->add_option("--layer", command->layer, "Layer to edit")->required();
  edit->add_option("--ttl", command->time_to_live,
                   "Delete the written objects after this time (30s, 2m)")
      ->type_name("DURATION")
      ->check(IsTimeout());
  edit->add_option("--if_version,--if-version", command->conditions.if_version,
                   "Apply only if every replaced or deleted object has this version")
      ->type_name("REVISION");
  edit->add_option("--if_layer_version,--if-layer-version", command->conditions.if_layer_version,
                   "Apply only if the layer has this version")
      ->type_name("REVISION");
  edit->callback([&selected, command] {
    absl::Duration time_to_live;
    if (absl::ParseDuration(command->time_to_live, &time_to_live)) {
      command->conditions.time_to_live = time_to_live;
    }
    selected = [command](Session& s) {
      return command->conditions.any() ? EditOnConditions(*command, s) : EditByFile(*command, s);
    };
  });
}

void AddExport(CLI::App& app, Command& selected) {
  auto command = std::make_shared<ExportCommand>();
  CLI::App* exporting =
      app.add_subcommand("export", "Export a map, or some of its layers, to a file");
  exporting->add_option("map", command->map, "Name of the map")->required()->type_name("MAP");
  exporting
      ->add_option("--output,-o", command->path, "File to write; for a nav2 map, its YAML file")
      ->required()
      ->type_name("FILE");
  exporting->add_option(
      "--format", command->format_name,
      "Format: hmap, nav2, geojson, gpkg or mcap, the map's history for ROS 2 (default: "
      "by the file's extension)");
  exporting
      ->add_option("--layer", command->options.layers,
                   "Layer to export; may be repeated (default: all)")
      ->type_name("LAYER")
      ->allow_extra_args(false);
  exporting->add_option("--image", command->image, "Image format, for nav2: pgm (default) or png")
      ->check(CLI::IsMember({"pgm", "png"}));
  const std::vector<CLI::Option*> of_history = AddHistoryOptions(*exporting, command->history);
  exporting->callback([&selected, command, of_history] {
    command->format = ValueOrUsageError(ExportFormatOf(command->format_name, command->path));
    const bool whole_map = std::holds_alternative<GeoPackage>(command->format);
    if (whole_map && !command->options.layers.empty()) {
      throw CLI::ValidationError(
          "--layer: not with a GeoPackage, which always contains the whole map");
    }
    for (const CLI::Option* option : of_history) {
      if (option->count() > 0 && !std::holds_alternative<Mcap>(command->format)) {
        throw CLI::ValidationError(option->get_name() + ": only with the format mcap");
      }
    }
    if (command->image == "png") command->options.image = client::ImageFormat::kPng;
    selected = [command](Session& s) { return Export(*command, s); };
  });
}

void AddBackup(CLI::App& app, Command& selected) {
  auto command = std::make_shared<ExportCommand>();
  CLI::App* backup =
      app.add_subcommand("backup", "Copy a map, as it is stored, to a GeoPackage file");
  backup->add_option("map", command->map, "Name of the map")->required()->type_name("MAP");
  backup->add_option("--output,-o", command->path, "File to write")->required()->type_name("FILE");
  backup->callback([&selected, command] {
    selected = [command](Session& s) { return Backup(command->map, command->path, s); };
  });
}

void AddRestore(CLI::App& app, Command& selected) {
  auto command = std::make_shared<RestoreCommand>();
  CLI::App* restore =
      app.add_subcommand("restore", "Make a backup a map of the server, which checks it before");
  restore->add_option("file", command->path, "File of hypermap backup")
      ->required()
      ->type_name("FILE");
  restore->add_option("--map", command->map,
                      "Name of the map (default: the file's name without .gpkg)");
  restore->add_flag("--replace", command->replace,
                    "Delete the map of that name before, if there is one");
  restore->callback([&selected, command] {
    if (command->map.empty()) command->map = std::filesystem::path(command->path).stem().string();
    selected = [command](Session& s) { return Restore(*command, s); };
  });
}

}  // namespace

void AddTransferCommands(CLI::App& app, Command& selected) {
  AddImport(app, selected);
  AddEdit(app, selected);
  AddExport(app, selected);
  AddBackup(app, selected);
  AddRestore(app, selected);
}

}  // namespace hypermap::cli
