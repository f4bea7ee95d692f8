// check: reads a stored map as a whole and reports what is wrong, and repairs files.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cpp/stored_evidence.h"
#include "storage/fusion_log.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_fetch.h"
#include "storage/geopackage/map_repair.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/file_lock.h"

namespace hypermap::cli {
namespace {

constexpr char kExtension[] = ".gpkg";
// Exit codes of the command besides 0.
constexpr int kExitFindings = 1;
constexpr int kExitNotChecked = 2;

struct CheckOptions {
  std::string what;
  bool repair = false;
  std::string from;  // the file with which damage of pages is repaired; empty: none
};

// Names of maps have neither slashes nor, by custom, the extension.
bool IsPath(const std::string& what) {
  return absl::StrContains(what, '/') || absl::EndsWith(what, kExtension) || what == ".";
}

absl::Status CheckEvidence(const storage::LogEntry& entry) {
  if (entry.key.number > 0) return client::DecodeStoredObject(entry.body).status();
  HYPERMAP_ASSIGN_OR_RETURN(const Observation observation,
                            client::DecodeStoredObservation(entry.body));
  if (KeyOf(observation) == entry.key.after) return absl::OkStatus();
  return absl::DataLossError("the body is that of another observation");
}

// The files of the maps in a folder, sorted; or the one file.
absl::StatusOr<std::vector<std::string>> FilesOf(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return std::vector<std::string>{path};
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(path, error)) {
    if (entry.path().extension() == kExtension) files.push_back(entry.path().string());
  }
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (files.empty()) return absl::NotFoundError(absl::StrCat(path, " has no file of a map"));
  std::sort(files.begin(), files.end());
  return files;
}

// Keeps servers from opening the file's map meanwhile. A file that no server has ever opened has no
// lock. FAILED_PRECONDITION if a server has it open.
absl::StatusOr<std::optional<storage::FileLock>> LockFile(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  const std::string lock = absl::StrCat(storage::FolderOf(path), "/.", name, ".lock");
  if (!storage::PathExists(lock)) return std::optional<storage::FileLock>();
  absl::StatusOr<storage::FileLock> locked = storage::FileLock::Acquire(lock);
  if (absl::IsFailedPrecondition(locked.status())) {
    return absl::FailedPreconditionError("a server has the map open: check it by its name");
  }
  HYPERMAP_RETURN_IF_ERROR(locked.status());
  return std::make_optional(*std::move(locked));
}

absl::StatusOr<CheckedMap> CheckFile(const std::string& path, const CheckOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FileLock> lock, LockFile(path));
  CheckedMap checked;
  checked.name = path;
  if (!options.from.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(storage::FetchReport fetched,
                              storage::FetchDamaged(path, options.from, CheckEvidence));
    checked.report = std::move(fetched.after);
    for (const storage::FetchReport::Layer& layer : fetched.layers) {
      checked.fetched[layer.name] = layer.rows;
      checked.num_repaired += static_cast<int64_t>(layer.rows.size());
    }
    checked.copy = std::move(fetched.copy);
    return checked;
  }
  if (!options.repair) {
    HYPERMAP_ASSIGN_OR_RETURN(checked.report, storage::CheckMapFile(path, CheckEvidence));
    return checked;
  }
  HYPERMAP_ASSIGN_OR_RETURN(storage::RepairReport repaired,
                            storage::RepairMapFile(path, CheckEvidence));
  checked.report = std::move(repaired.after);
  checked.num_repaired = static_cast<int64_t>(repaired.before.findings.size()) +
                         repaired.before.more -
                         static_cast<int64_t>(checked.report.findings.size()) - checked.report.more;
  checked.copy = std::move(repaired.copy);
  return checked;
}

// Files that can't be checked do not keep the others from being checked.
absl::Status CheckFiles(const CheckOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> files, FilesOf(options.what));
  std::vector<CheckedMap> checked;
  absl::Status status;
  for (const std::string& file : files) {
    absl::StatusOr<CheckedMap> result = CheckFile(file, options);
    if (!result.ok()) {
      status.Update(absl::Status(result.status().code(),
                                 absl::StrCat(file, ": ", result.status().message())));
      continue;
    }
    if (!result->report.is_clean()) s.exit_code = kExitFindings;
    checked.push_back(*std::move(result));
  }
  if (!checked.empty()) s.output.Show(checked);
  return status;
}

absl::Status CheckOnServer(const CheckOptions& options, Session& s) {
  if (options.repair || !options.from.empty()) {
    return absl::InvalidArgumentError(
        "--repair and --from: only for a file that no server has open, such as ./site.gpkg");
  }
  CheckedMap checked;
  checked.name = options.what;
  HYPERMAP_ASSIGN_OR_RETURN(checked.report, s.client.CheckMap(options.what));
  if (!checked.report.is_clean()) s.exit_code = kExitFindings;
  s.output.Show(std::vector<CheckedMap>{std::move(checked)});
  return absl::OkStatus();
}

}  // namespace

void AddCheckCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* check = app.add_subcommand(
      "check",
      "Check a stored map as a whole: of a server, or a file or folder that no server has open. "
      "Exit code 1: something is wrong; 2: not all could be checked");
  check
      ->add_option("map", options->what,
                   "Name of a map of the server; or a path, which has a slash or ends with .gpkg")
      ->required()
      ->type_name("MAP|FILE|FOLDER");
  check->add_flag("--repair", options->repair,
                  "Rebuild what follows from the rest of the file, after a copy of it");
  check
      ->add_option(
          "--from", options->from,
          "With --repair: another copy of the map, a backup or the file of a replica, from "
          "which objects and tiles are fetched that can't be read. They are taken if the "
          "history tells that nobody has changed them since")
      ->needs("--repair")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  check->callback([&selected, options] {
    selected = [options](Session& s) {
      s.failure_code = kExitNotChecked;
      return IsPath(options->what) ? CheckFiles(*options, s) : CheckOnServer(*options, s);
    };
  });
}

}  // namespace hypermap::cli
