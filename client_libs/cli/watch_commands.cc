// watch, changes, log.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/validators.h"

namespace hypermap::cli {
namespace {

struct WatchCommand {
  std::string map;
  client::WatchOptions options;
  std::vector<std::string> area;
  std::optional<int64_t> count;
  std::optional<Revision> until;
};

struct ChangesCommand {
  std::string map;
  Scope scope;
  Revision from = 0;
  std::optional<Revision> to;
};

struct LogCommand {
  std::string map;
  int limit = 50;
};

// Decides whether a watch has shown the changes that --count or --until ask for.
class WatchEnd {
 public:
  explicit WatchEnd(const WatchCommand& command) : count_(command.count), until_(command.until) {}

  bool After(const client::WatchEvent& event) {
    if (!event.snapshot) shown_ += static_cast<int64_t>(event.changes.size());
    return (count_ && shown_ >= *count_) || (until_ && event.revision >= *until_);
  }

 private:
  const std::optional<int64_t> count_;
  const std::optional<Revision> until_;
  int64_t shown_ = 0;
};

absl::Status Watch(const WatchCommand& command, Session& s) {
  client::WatchOptions options = command.options;
  if (!command.area.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(Polygon area, ParsePolygon(command.area));
    options.area = std::move(area);
  }
  client::CallOptions call;
  call.timeout = s.timeout;
  client::Watcher watcher = s.client.Watch(command.map, options, call);
  WatchEnd end(command);
  while (const std::optional<client::WatchEvent> event = watcher.Next()) {
    s.output.Show(*event);
    if (end.After(*event)) return absl::OkStatus();
  }
  return watcher.status();
}

// The newest revision up to `to`.
absl::StatusOr<std::optional<client::RevisionRecord>> LastRevision(const ChangesCommand& command,
                                                                   client::Client& client) {
  const client::RevisionPage page{
      .before = command.to ? *command.to + 1 : 0, .size = 1, .newest_first = true};
  HYPERMAP_ASSIGN_OR_RETURN(client::RevisionList list, client.ListRevisions(command.map, page));
  if (list.revisions.empty()) return std::nullopt;
  return list.revisions.front();
}

absl::Status Changes(const ChangesCommand& command, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto last, LastRevision(command, s.client));
  std::optional<Revision> to = command.to;
  std::optional<absl::Time> time;
  if (last) {
    if (!to) to = last->revision;
    if (*to == last->revision) time = last->time;
  }
  client::ChangeReader reader = s.client.ListChanges(command.map, command.from, to, command.scope);
  while (std::optional<client::MapChange> change = reader.Next()) {
    s.output.Show(DifferenceChange{reader.to_revision(), time, *std::move(change)});
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  s.output.EndDifference(command.from, to.value_or(reader.to_revision()));
  return absl::OkStatus();
}

absl::Status Log(const LogCommand& command, Session& s) {
  client::RevisionList all;
  client::RevisionPage page{.newest_first = true};
  while (true) {
    page.size = std::min(command.limit - static_cast<int>(all.revisions.size()), 1000);
    HYPERMAP_ASSIGN_OR_RETURN(client::RevisionList list, s.client.ListRevisions(command.map, page));
    if (all.map.empty()) {
      all = list;
    } else {
      all.revisions.insert(all.revisions.end(), list.revisions.begin(), list.revisions.end());
    }
    if (list.revisions.empty() || static_cast<int>(all.revisions.size()) >= command.limit) break;
    page.before = list.revisions.back().revision;
  }
  s.output.Show(all);
  return absl::OkStatus();
}

void AddScope(CLI::App& command, std::string& map, Scope& scope) {
  command.add_option("map", map, "Name of the map")->required()->type_name("MAP");
  command.add_option("--layer", scope.layers, "Layer to read; may be repeated (default: all)")
      ->type_name("LAYER")
      ->allow_extra_args(false);
  command.add_option("--frame", scope.frame_id,
                     "Frame of the coordinates (default: the map's own)");
}

void AddWatch(CLI::App& app, Command& selected) {
  auto command = std::make_shared<WatchCommand>();
  CLI::App* watch = app.add_subcommand(
      "watch", "Print the content of a map, then each change; reconnects after interruptions");
  AddScope(*watch, command->map, command->options.scope);
  watch->add_option("--area", command->area, "Only content in the polygon with these vertices")
      ->type_name("X,Y")
      ->check(IsPoint());
  watch
      ->add_option("--class", command->options.classes,
                   "Only objects with this label or alias; may be repeated")
      ->type_name("LABEL")
      ->allow_extra_args(false);
  watch
      ->add_option("--from", command->options.start_revision,
                   "Print only the changes after this revision, without the content of the map")
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
  watch
      ->add_option("--incarnation", command->options.incarnation,
                   "Incarnation of the map to which the revision of --from belongs (see maps "
                   "--json); fail if the map was restored, replaced or made anew since")
      ->type_name("NUMBER");
  watch->add_flag("--or_snapshot,--or-snapshot", command->options.snapshot_when_compacted,
                  "Print the content of the map if the changes to resume from have been compacted, "
                  "or the map is another incarnation");
  watch->add_option("--count", command->count, "Stop after this many changes")
      ->check(CLI::PositiveNumber);
  watch->add_option("--until", command->until, "Stop after all changes up to this revision")
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
  watch->callback(
      [&selected, command] { selected = [command](Session& s) { return Watch(*command, s); }; });
}

void AddChanges(CLI::App& app, Command& selected) {
  auto command = std::make_shared<ChangesCommand>();
  CLI::App* changes = app.add_subcommand("changes", "Print the difference between two revisions");
  AddScope(*changes, command->map, command->scope);
  changes->add_option("--from", command->from, "Earlier revision")
      ->required()
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
  changes->add_option("--to", command->to, "Later revision (default: the newest)")
      ->type_name("REVISION")
      ->check(CLI::NonNegativeNumber);
  changes->callback(
      [&selected, command] { selected = [command](Session& s) { return Changes(*command, s); }; });
}

void AddLog(CLI::App& app, Command& selected) {
  auto command = std::make_shared<LogCommand>();
  CLI::App* log =
      app.add_subcommand("log", "List the revisions in the history of a map, newest first");
  log->add_option("map", command->map, "Name of the map")->required()->type_name("MAP");
  log->add_option("--limit", command->limit, "Maximum number of revisions")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  log->callback(
      [&selected, command] { selected = [command](Session& s) { return Log(*command, s); }; });
}

}  // namespace

void AddWatchCommands(CLI::App& app, Command& selected) {
  AddWatch(app, selected);
  AddChanges(app, selected);
  AddLog(app, selected);
}

}  // namespace hypermap::cli
