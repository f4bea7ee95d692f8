// Many watchers of one map.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

class Watcher;

// Each watcher reads all changes of a map after a revision on its own stream, as fast as they come
// (several in a message if the server coalesces them), and checks that there is no gap, repetition
// or reordering. Destruction ends the streams.
class Watchers {
 public:
  // Does not wait. The watchers share the channels evenly.
  Watchers(const Channels& channels, const std::string& map, int64_t after_revision, int count);
  ~Watchers();

  // Waits until all watchers have received `revision`. Returns the first error of a watcher.
  absl::Status WaitUntil(int64_t revision);

  // Times from a commit, as its change says, until a watcher had read it. Seconds, sorted.
  std::vector<double> LatenciesS() const;
  // Times at which the first watcher had read each revision, in order. Seconds since the Unix
  // epoch.
  std::vector<double> ReceivedS() const;
  // Number of messages and bytes that all watchers together have read.
  int64_t messages() const;
  int64_t bytes() const;

 private:
  std::vector<std::unique_ptr<Watcher>> watchers_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_WATCHERS_H_
