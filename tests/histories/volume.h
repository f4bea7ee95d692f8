// The files of the simulated server.
#ifndef HYPERMAP_TESTS_HISTORIES_VOLUME_H_
#define HYPERMAP_TESTS_HISTORIES_VOLUME_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "storage/map_store.h"
#include "tests/histories/schedule.h"

namespace hypermap::histories {

// Holds the maps of a store, and what a crash leaves of them.
class Volume {
 public:
  virtual ~Volume() = default;

  virtual absl::StatusOr<std::unique_ptr<storage::MapStore>> Open() = 0;
  // With faults, writes, truncations and syncs of files fail at random.
  virtual void set_faults(bool faults) = 0;
  // The next write of a map begins; with `syncs` false, its syncs do nothing.
  virtual void BeginWrite(bool syncs) = 0;
  virtual void EndWrite() = 0;
  // The process is killed, or the machine loses power: keeps what is left, whatever is written from
  // here on. The other form is for a crash at some moment of the last write, which may leave it
  // whole or not at all.
  virtual void Crash() = 0;
  virtual void CrashDuringLastWrite() = 0;
  // Makes the files those that the crash left. REQUIRES: nobody uses them.
  virtual void Restart() = 0;
};

// In memory: fast, and a write is one step.
std::unique_ptr<Volume> MakeMemoryVolume();
// GeoPackage files in `folder`, which need not exist: slow. A power loss takes any part of what was
// not synced. At most one lives at a time.
std::unique_ptr<Volume> MakeGeoPackageVolume(Schedule* schedule, const std::string& folder);

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_VOLUME_H_
