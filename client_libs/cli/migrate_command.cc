// migrate: copies maps between stores, which it opens itself.
#include <filesystem>
#include <memory>
#include <ostream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/pinned_map.h"
#include "storage/transfer/migration.h"
#ifdef HYPERMAP_POSTGRES
#include "storage/postgres/postgres_store.h"
#endif

namespace hypermap::cli {
namespace {

using storage::MapStore;
using storage::Migration;

// Exit codes of the command besides 0.
constexpr int kExitDiffers = 1;
constexpr int kExitInUse = 3;

constexpr absl::Duration kReportEvery = absl::Seconds(5);

struct MigrateOptions {
  std::string from;
  std::string to;
  std::vector<std::string> maps;  // empty: all
  bool dry_run = false;
  bool verify_only = false;

  bool only_reads() const { return dry_run || verify_only; }
};

bool IsDatabase(const std::string& store) {
  return absl::StartsWith(store, "postgresql://") || absl::StartsWith(store, "postgres://");
}

absl::StatusOr<std::unique_ptr<MapStore>> OpenDatabase(const std::string& target) {
#ifdef HYPERMAP_POSTGRES
  storage::PostgresOptions options;
  options.target = target;
  return storage::OpenPostgresStore(options);
#else
  return absl::InvalidArgumentError(
      absl::StrCat(target, ": this program was built without PostgreSQL"));
#endif
}

// A folder that a server uses is read beside it.
absl::StatusOr<std::unique_ptr<MapStore>> OpenSource(const MigrateOptions& options) {
  if (IsDatabase(options.from)) return OpenDatabase(options.from);
  std::error_code error;
  if (!std::filesystem::is_directory(options.from, error)) {
    return absl::NotFoundError(absl::StrCat("no folder ", options.from));
  }
  if (options.only_reads()) return storage::OpenGeoPackageReader(options.from);
  absl::StatusOr<std::unique_ptr<MapStore>> store = storage::OpenGeoPackageStore(options.from);
  if (!absl::IsFailedPrecondition(store.status())) return store;
  return storage::OpenGeoPackageReader(options.from);
}

// Null if nothing is to be written, and there is no such folder.
absl::StatusOr<std::unique_ptr<MapStore>> OpenTarget(const MigrateOptions& options) {
  if (IsDatabase(options.to)) return OpenDatabase(options.to);
  if (!options.only_reads()) return storage::OpenGeoPackageStore(options.to);
  absl::StatusOr<std::unique_ptr<MapStore>> store = storage::OpenGeoPackageReader(options.to);
  if (absl::IsNotFound(store.status())) return nullptr;
  return store;
}

// Prints how far the copy of a map is, now and then.
std::function<void(Revision)> Progress(const std::string& map, std::ostream& err) {
  return [&err, map, last = absl::Now()](Revision revision) mutable {
    if (absl::Now() - last < kReportEvery) return;
    last = absl::Now();
    err << map << ": copied up to revision " << revision << std::endl;
  };
}

int ExitCodeOf(const std::vector<MigratedMap>& maps) {
  int exit_code = kExitOk;
  for (const MigratedMap& map : maps) {
    if (!map.problem.empty() || map.migration.state == Migration::State::kDiffers) {
      return kExitDiffers;
    }
    if (map.migration.state == Migration::State::kInUse) exit_code = kExitInUse;
  }
  return exit_code;
}

// A map that can't be copied does not keep the others from being copied.
absl::Status Migrate(const MigrateOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<MapStore> from, OpenSource(options));
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<MapStore> to, OpenTarget(options));
  std::vector<std::string> names = options.maps;
  if (names.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(names, from->List());
  }
  std::vector<MigratedMap> migrated;
  for (const std::string& name : names) {
    absl::StatusOr<Migration> migration =
        options.only_reads() ? storage::CompareMaps(*from, to.get(), name)
                             : storage::MigrateMap(*from, *to, name, Progress(name, s.err));
    if (!migration.ok()) {
      migrated.push_back({Migration{name}, std::string(migration.status().message())});
      continue;
    }
    const bool is_missing = options.verify_only && migration->state == Migration::State::kToCopy;
    migrated.push_back({*std::move(migration), is_missing ? "there is no copy" : ""});
  }
  s.exit_code = ExitCodeOf(migrated);
  s.output.Show(migrated);
  return absl::OkStatus();
}

}  // namespace

void AddMigrateCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<MigrateOptions>();
  CLI::App* migrate = app.add_subcommand(
      "migrate",
      "Copy maps with their history, evidence and receipts from one store to another, and compare "
      "digests. Exit code 1: a copy is not equal, or could not be made; 3: copies are unfinished, "
      "because a server has the maps open");
  constexpr char kStore[] = "FOLDER|postgresql://…";
  migrate->add_option("--from", options->from, "The store of the maps")
      ->required()
      ->type_name(kStore);
  migrate->add_option("--to", options->to, "The store that gets the copies")
      ->required()
      ->type_name(kStore);
  migrate->add_option("--map", options->maps, "Only this map; may be repeated")->type_name("MAP");
  CLI::Option* dry_run = migrate->add_flag("--dry_run", options->dry_run,
                                           "Tell what would be copied, and copy nothing");
  migrate
      ->add_flag("--verify_only", options->verify_only,
                 "Compare maps with the copies that were made of them, and copy nothing")
      ->excludes(dry_run);
  migrate->callback([&selected, options] {
    selected = [options](Session& s) {
      s.uses_server = false;
      return Migrate(*options, s);
    };
  });
}

}  // namespace hypermap::cli
