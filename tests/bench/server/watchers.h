// Many that watch one map.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

class Watcher;

// Each reads all changes of a map after a revision, on its own stream, as fast as they come (those
// that come together in one message), and checks that they come in order, none twice and none left
// out. Ends the streams with itself.
class Watchers {
 public:
  // Returns at once. `channels` are shared out between them.
  Watchers(const Channels& channels, const std::string& map, int64_t after_revision, int count);
  ~Watchers();

  // Returns when all have been told of `revision`; the first error of one.
  absl::Status WaitUntil(int64_t revision);

  // From the time in a change, which is that of its commit, until it was read; seconds, sorted.
  std::vector<double> LatenciesS() const;
  // Messages that all have read, and the bytes of all.
  int64_t messages() const;
  int64_t bytes() const;

 private:
  std::vector<std::unique_ptr<Watcher>> watchers_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_
