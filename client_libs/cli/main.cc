#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "client_libs/cli/run.h"
#include "client_libs/cpp/scoped_grpc.h"

int main(int argc, char** argv) {
  // Silences gRPC's log, since the status of a failed call says everything and an error is printed
  // as one line.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  const std::vector<std::string> args(argv + 1, argv + argc);
  // The load of a fleet has hundreds of threads with a connection each. By default, one thread of
  // gRPC's polls the connections of all and wakes the others up. With poll(2) each waits for its
  // own, which halves the latency that the load itself adds.
  if (std::find(args.begin(), args.end(), "bench") != args.end()) {
    setenv("GRPC_POLL_STRATEGY", "poll", /*overwrite=*/0);
  }
  const hypermap::client::ScopedGrpc grpc;
  std::ios::sync_with_stdio(false);  // nothing here uses stdio
  return hypermap::cli::Run(args, std::cin, std::cout, std::cerr);
}
