// The disk of the simulated server.
#ifndef HYPERMAP_TESTS_HISTORIES_SERVER_DISK_H_
#define HYPERMAP_TESTS_HISTORIES_SERVER_DISK_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "storage/map_store.h"
#include "tests/histories/plant.h"
#include "tests/histories/record.h"
#include "tests/histories/schedule.h"
#include "tests/histories/volume.h"

namespace hypermap::histories {

inline constexpr char kMap[] = "site";

// A volume that is full at times, and on which the process is killed before, during or after a
// write. Every commit that reaches it is recorded.
class ServerDisk {
 public:
  // All must outlive this. `killed` is called when the process is killed during a write.
  ServerDisk(Schedule* schedule, Record* record, Volume* volume, Plant plant,
             std::function<void()> killed);

  // Makes the map, without commits.
  absl::Status CreateMap();
  // The store as a server process sees it.
  absl::StatusOr<std::unique_ptr<storage::MapStore>> Open();

  // With faults, writes fail at random.
  void set_faults(bool faults) { faults_ = faults; }
  // The process is killed now: whatever it does from here on until Restart is lost.
  void Kill();
  bool is_killed() const { return is_killed_; }
  // Must be called after a kill when the process is gone.
  void Restart();

  // For the stored maps of Open.
  absl::Status Write(storage::StoredMap& map, absl::Span<const storage::Commit> commits);
  absl::Status CheckWritable();

 private:
  absl::Status Store(storage::StoredMap& map, absl::Span<const storage::Commit> commits);
  // Does what a process does that is killed at some moment of a write.
  absl::Status DieDuring(storage::StoredMap& map, absl::Span<const storage::Commit> commits);
  void IsKilled();

  Schedule* const schedule_;
  Record* const record_;
  Volume* const volume_;
  const Plant plant_;
  const std::function<void()> killed_;
  bool faults_ = false;
  bool is_killed_ = false;
  // Plant::kPublishEarly: commits that were reported as written and are not.
  std::vector<storage::Commit> early_;
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_SERVER_DISK_H_
