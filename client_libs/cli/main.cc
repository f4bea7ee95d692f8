#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "client_libs/cli/run.h"
#include "client_libs/cpp/scoped_grpc.h"

int main(int argc, char** argv) {
  // Silences gRPC's log, since the status of a failed call says everything and an error is printed
  // as one line.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  std::ios::sync_with_stdio(false);  // nothing here uses stdio
  // gRPC starts when the command is known, because `bench` chooses how gRPC polls.
  std::optional<hypermap::client::ScopedGrpc> grpc;
  return hypermap::cli::Run(std::vector<std::string>(argv + 1, argv + argc), std::cin, std::cout,
                            std::cerr, [&grpc] { grpc.emplace(); });
}
