// Other libraries asked in process which objects of a site cover a point.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/point.h"
#include "tests/bench/server/generated_site.h"

namespace hypermap::bench {

// One thread.
class InProcessPeer {
 public:
  virtual ~InProcessPeer() = default;
  // How many objects cover the point.
  virtual int CountAt(const Point& p) = 0;
};

struct InProcessPeerKind {
  const char* name;
  // Loads the site into it.
  absl::StatusOr<std::unique_ptr<InProcessPeer>> (*make)(const GeneratedSite& site);
};

// SQLite's R*Tree with our own test of the candidates, SpatiaLite, Boost.Geometry's packed R-tree,
// and the STRtree of GEOS with prepared geometries; those that this was built with.
std::vector<InProcessPeerKind> InProcessPeerKinds();

// Of those that are not in InProcessPeerKinds.
std::vector<std::string> MissingInProcessPeers();

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_
