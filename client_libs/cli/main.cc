#include <iostream>
#include <string>
#include <vector>

#include "client_libs/cli/run.h"

int main(int argc, char** argv) {
  std::ios::sync_with_stdio(false);  // nothing here writes with stdio
  return hypermap::cli::Run(std::vector<std::string>(argv + 1, argv + argc), std::cin, std::cout,
                            std::cerr);
}
