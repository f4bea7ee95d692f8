#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "client_libs/cli/run.h"

int main(int argc, char** argv) {
  // What gRPC has to say of a failed call stands in its status; an error is one line.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  std::ios::sync_with_stdio(false);  // nothing here writes with stdio
  return hypermap::cli::Run(std::vector<std::string>(argv + 1, argv + argc), std::cin, std::cout,
                            std::cerr);
}
