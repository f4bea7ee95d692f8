// The `hypermap` command.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_RUN_H_
#define HYPERMAP_CLIENT_LIBS_CLI_RUN_H_

#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"

namespace hypermap::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitError = 1;  // the command failed
inline constexpr int kExitUsage = 2;  // the command line was not understood

// Runs one command line (without the program's name) and returns the exit code. Commands read their
// input from `in` and print answers to `out`; an error is one line on `err`. `start_grpc` is called
// once the command is known and before it makes clients.
int Run(
    std::vector<std::string> args, std::istream& in, std::ostream& out, std::ostream& err,
    absl::FunctionRef<void()> start_grpc = [] {});

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_RUN_H_
