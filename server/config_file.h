// Flags from a file.
#ifndef HYPERMAP_SERVER_CONFIG_FILE_H_
#define HYPERMAP_SERVER_CONFIG_FILE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::server {

// A flag as a file sets it.
struct FlagValue {
  std::string name;
  std::string value;
};

// The flags that a YAML text sets: a mapping of their names, without dashes, to their values.
// INVALID_ARGUMENT naming the line for what is no flag of hypermapd or no scalar, and for a name
// that occurs twice.
absl::StatusOr<std::vector<FlagValue>> ParseConfig(const std::string& yaml);

// Sets the flags. INVALID_ARGUMENT for a value that the flag can't have.
absl::Status SetFlags(const std::vector<FlagValue>& values);

// The value of --config on a command line; empty if it has none. The flag is read before the
// others, so that they win over the file.
std::string ConfigOnCommandLine(const std::vector<absl::string_view>& args);

// Sets the flags that the file `path` sets. Errors name the file.
absl::Status ReadConfigFile(const std::string& path);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_CONFIG_FILE_H_
