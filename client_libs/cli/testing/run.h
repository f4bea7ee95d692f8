// Runs whole command lines in tests, and reads and writes their files.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TESTING_RUN_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TESTING_RUN_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client_libs/cli/run.h"
#include "client_libs/testing/scripted_server.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::cli {

using Args = std::vector<std::string>;

struct Outcome {
  int exit_code;
  std::string out;
  std::string err;
};

inline Outcome RunCommand(const Args& args, const std::string& input = "") {
  std::istringstream in(input);
  std::ostringstream out, err;
  const int exit_code = Run(args, in, out, err);
  return {exit_code, out.str(), err.str()};
}

inline Outcome RunOn(const client::ScriptedServer& server, Args args,
                     const std::string& input = "") {
  args.insert(args.begin(), {"--server", server.address()});
  return RunCommand(args, input);
}

inline void Put(const std::string& path, const std::string& data) {
  std::ofstream(path, std::ios::binary) << data;
}

inline std::string Get(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TESTING_RUN_H_
