// whats_here HOST:PORT MAP X Y: prints the content of each layer at a point.
#include <cstdio>
#include <cstdlib>

#include "client_libs/cpp/client.h"

using hypermap::client::Client;

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "whats_here HOST:PORT MAP X Y\n"), EXIT_FAILURE;
  Client client(argv[1]);
  const hypermap::Point place{std::atof(argv[3]), std::atof(argv[4])};

  const auto here = client.QueryPoint(argv[2], place);
  if (!here.ok()) {
    std::fprintf(stderr, "%s\n", here.status().ToString().c_str());
    return EXIT_FAILURE;
  }
  for (const auto& layer : here->layers) {
    std::printf("%s:", layer.layer.c_str());
    if (layer.value) std::printf(" %g", *layer.value);
    for (const auto& object : layer.objects) std::printf(" %s", object.label.c_str());
    std::printf("\n");
  }
  return EXIT_SUCCESS;
}
