// rebuild, retract, explain.
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {
namespace {

struct FusionOptions {
  std::string map;
  std::string layer;
  std::string strategy;
  std::vector<std::string> parameters;  // NAME=NUMBER
  std::string robot;
  std::string from;
  std::string to;
  ObjectId object_id = 0;
};

// Splits NAME=NUMBER. Returns false if the text is not of that form.
bool ParseParameter(const std::string& text, std::string* name, double* value) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return false;
  *name = text.substr(0, equals);
  return absl::SimpleAtod(text.substr(equals + 1), value);
}

// Parses an RFC 3339 time or seconds since 1970.
bool ParseStamp(const std::string& text, absl::Time* time) {
  if (absl::ParseTime(absl::RFC3339_full, text, time, nullptr)) return true;
  absl::Duration since_epoch;
  if (!absl::ParseDuration(absl::StrCat(text, "s"), &since_epoch)) return false;
  *time = absl::UnixEpoch() + since_epoch;
  return true;
}

CLI::Validator IsParameter() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        std::string name;
        double value = 0.0;
        return ParseParameter(text, &name, &value) ? "" : text + " is not NAME=NUMBER";
      },
      "");
}

CLI::Validator IsStamp() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        absl::Time time;
        return ParseStamp(text, &time)
                   ? ""
                   : text + " is neither an RFC 3339 time nor a number of seconds";
      },
      "");
}

std::string ParametersJson(const std::vector<std::string>& parameters) {
  if (parameters.empty()) return "";
  auto json = nlohmann::json::object();
  for (const std::string& parameter : parameters) {
    std::string name;
    double value = 0.0;
    if (ParseParameter(parameter, &name, &value)) json[name] = value;
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

absl::Time StampOr(const std::string& text, absl::Time otherwise) {
  absl::Time time;
  return !text.empty() && ParseStamp(text, &time) ? time : otherwise;
}

absl::Status Rebuild(const FusionOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Revision revision,
                            s.client.RebuildLayer(options.map, options.layer, options.strategy,
                                                  ParametersJson(options.parameters)));
  s.output.Show(Done{options.map, "rebuilt", options.layer, revision});
  return absl::OkStatus();
}

absl::Status Retract(const FusionOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Revision revision,
                            s.client.RetractSource(options.map, options.layer, options.robot,
                                                   StampOr(options.from, absl::InfinitePast()),
                                                   StampOr(options.to, absl::InfiniteFuture())));
  s.output.Show(Done{options.map, "observations removed", options.layer, revision});
  return absl::OkStatus();
}

absl::Status Explain(const FusionOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::ObjectHistory history,
                            s.client.ExplainObject(options.map, options.layer, options.object_id));
  s.output.Show(history);
  return absl::OkStatus();
}

void AddMapAndLayer(CLI::App& command, FusionOptions& options) {
  command.add_option("map", options.map, "Name of the map")->required()->type_name("MAP");
  command.add_option("--layer", options.layer, "Name of the fused layer")
      ->required()
      ->type_name("NAME");
}

}  // namespace

void AddIngestCommands(CLI::App& app, Command& selected) {
  auto options = std::make_shared<FusionOptions>();
  CLI::App* rebuild =
      app.add_subcommand("rebuild", "Recompute a fused layer from its stored observations");
  AddMapAndLayer(*rebuild, *options);
  rebuild
      ->add_option("--fusion", options->strategy,
                   "Fusion strategy: evidence or paper (default: unchanged)")
      ->type_name("STRATEGY");
  rebuild->add_option("--param", options->parameters, "Parameter of the strategy; may be repeated")
      ->type_name("NAME=NUMBER")
      ->check(IsParameter());
  rebuild->callback(
      [&selected, options] { selected = [options](Session& s) { return Rebuild(*options, s); }; });

  CLI::App* retract =
      app.add_subcommand("retract", "Remove the observations of a robot from a fused layer");
  AddMapAndLayer(*retract, *options);
  retract->add_option("--robot", options->robot, "Name of the robot")
      ->required()
      ->type_name("NAME");
  retract
      ->add_option("--from", options->from,
                   "Remove observations from this stamp on (default: from the first): RFC 3339, or "
                   "seconds since 1970")
      ->type_name("T")
      ->check(IsStamp());
  retract
      ->add_option("--to", options->to,
                   "Remove observations before this stamp (default: to the last)")
      ->type_name("T")
      ->check(IsStamp());
  retract->callback(
      [&selected, options] { selected = [options](Session& s) { return Retract(*options, s); }; });

  CLI::App* explain =
      app.add_subcommand("explain", "Show the observations that an object was fused from");
  AddMapAndLayer(*explain, *options);
  explain->add_option("id", options->object_id, "Id of the object")->required()->type_name("ID");
  explain->callback(
      [&selected, options] { selected = [options](Session& s) { return Explain(*options, s); }; });
}

}  // namespace hypermap::cli
