// Other libraries, queried in this process for the objects of a site that cover a point.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/geometry/point.h"
#include "tests/bench/server/generated_site.h"

namespace hypermap::bench {

// Used by one thread.
class InProcessPeer {
 public:
  virtual ~InProcessPeer() = default;
  // Number of objects that cover the point.
  virtual int CountAt(const Point& p) = 0;
};

struct InProcessPeerKind {
  const char* name;
  // Loads the site.
  absl::StatusOr<std::unique_ptr<InProcessPeer>> (*make)(const GeneratedSite& site);
};

// SQLite's R*Tree with our own test of the candidates, SpatiaLite, Boost.Geometry's packed R-tree,
// and GEOS's STRtree with prepared geometries, as far as this program was built with them.
std::vector<InProcessPeerKind> InProcessPeerKinds();

// Names of the peers that this program was built without.
std::vector<std::string> MissingInProcessPeers();

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_IN_PROCESS_PEERS_H_
