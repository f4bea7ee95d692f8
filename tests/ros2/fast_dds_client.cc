// Clients of services that are made of Fast DDS and speak as rmw_fastrtps_cpp does, for
// test_fast_dds.py.
//
//   ros2_fast_dds_client DOMAIN SERVICE TYPE
//
// Each line of the input is a request in CDR, in hexadecimal, and each line of the output the reply
// to it. Exit code 1: there is no such service, or a request was not answered.
#include <cstdlib>
#include <iostream>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "client_libs/ros2/dds/testing/fast_client.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kTimeout = absl::Seconds(60);

int Main(int argc, char** argv) {
  DdsOptions options;
  options.node_name = "fast_dds_client";
  options.localhost_only = true;
  if (argc != 4 || !absl::SimpleAtoi(argv[1], &options.domain)) {
    std::cerr << "usage: ros2_fast_dds_client DOMAIN SERVICE TYPE\n";
    return EXIT_FAILURE;
  }
  FastClient client(options, argv[2], argv[3]);
  if (!client.AwaitService(kTimeout)) {
    std::cerr << "nobody serves " << argv[2] << "\n";
    return EXIT_FAILURE;
  }
  std::string line;
  while (std::getline(std::cin, line)) {
    const auto reply = client.Call(absl::HexStringToBytes(line), kTimeout);
    if (!reply.has_value()) {
      std::cerr << "no reply to " << line << "\n";
      return EXIT_FAILURE;
    }
    std::cout << absl::BytesToHexString(*reply) << std::endl;
  }
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace hypermap::ros2

int main(int argc, char** argv) { return hypermap::ros2::Main(argc, argv); }
