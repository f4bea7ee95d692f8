// demo: runs the tour of the office that is installed beside the command (demo/run.sh).
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {
namespace {

struct DemoOptions {
  bool leave = false;
  bool stop = false;
};

// Where the demo keeps its maps and logs: a folder of the user's own state (XDG base directories).
absl::StatusOr<std::filesystem::path> StateFolder() {
  // $DEMO_DIR is also what the script reads.
  if (const char* folder = std::getenv("DEMO_DIR"); folder != nullptr && *folder != '\0') {
    return std::filesystem::path(folder);
  }
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state == '/') {
    return std::filesystem::path(state) / "hypermap-demo";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/') {
    return std::filesystem::path(home) / ".local/state/hypermap-demo";
  }
  return absl::FailedPreconditionError("$HOME is not set: the demo has no folder for its maps");
}

// Becomes the script, and returns only if that is not possible.
absl::Status Demo(const DemoOptions& options) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return absl::NotFoundError("/proc/self/exe: can't be read");
  const std::filesystem::path folder = program.parent_path();
  const std::string script = folder.parent_path() / "share/hypermap/demo/run.sh";
  if (!std::filesystem::exists(script, error)) {
    return absl::NotFoundError(absl::StrCat("no demo in ", script, " (in a checkout: make demo)"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::filesystem::path state, StateFolder());
  setenv("DEMO_BIN", folder.c_str(), /*overwrite=*/1);
  setenv("DEMO_DIR", state.c_str(), /*overwrite=*/1);
  std::vector<const char*> arguments = {"bash", script.c_str(), "--brief"};
  if (options.leave) arguments.push_back("--exit");
  if (options.stop) arguments.push_back("--stop");
  arguments.push_back(nullptr);
  execv("/bin/bash", const_cast<char* const*>(arguments.data()));
  return absl::ErrnoToStatus(errno, "/bin/bash can't be started");
}

}  // namespace

void AddDemoCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* demo = app.add_subcommand(
      "demo", "Start a server, robots and the dashboard with the map of a small office");
  CLI::Option* leave = demo->add_flag("--exit", options->leave, "Stop the programs at the end");
  demo->add_flag("--stop", options->stop, "Stop the programs of an earlier demo")->excludes(leave);
  demo->callback(
      [&selected, options] { selected = [options](Session&) { return Demo(*options); }; });
}

}  // namespace hypermap::cli
