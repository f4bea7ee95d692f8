// What the conformance suites need of a store. The suites are tests of what map_store.h, history.h
// and fusion_log.h promise, for every store.
//
// A test program runs all of them on its stores if it links the whole archive of
// hypermap::conformance and defines StoreKinds:
//
//   std::vector<StoreKind> StoreKinds() {
//     return {{"GeoPackage", [] { return std::make_unique<GeoPackageWorld>(); }}};
//   }
#ifndef HYPERMAP_STORAGE_CONFORMANCE_STORE_WORLD_H_
#define HYPERMAP_STORAGE_CONFORMANCE_STORE_WORLD_H_

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "storage/map_store.h"

namespace hypermap::storage {

// An empty place where stores of one kind keep their maps, for one test.
class StoreWorld {
 public:
  virtual ~StoreWorld() = default;

  // Opens the store of this place, as a process does that has just started. REQUIRES: the store
  // that was opened before is gone, and so are its maps.
  virtual std::unique_ptr<MapStore> Open() = 0;

  // Opens the store as it would be found if the process were killed now, while it uses the store
  // that was opened before. That one, its maps and their readers may only be destroyed afterwards.
  // Null if the kind of store can't show that.
  virtual std::unique_ptr<MapStore> OpenAfterKill() { return nullptr; }

  // Opens a store of its own whose map `name` is the copy that a MapBackup has written to `path`.
  // Null if the copies of this kind of store can't be opened.
  virtual std::unique_ptr<MapStore> OpenCopy(const std::string& /*path*/,
                                             const std::string& /*name*/) {
    return nullptr;
  }
};

// The promises that a store does not keep. The suites skip their tests.
struct Exceptions {
  // Refuses commits that do not fit to the map, or whose text can't be stored.
  bool content = false;
  // Charges what it reads to the work of the thread (base/metering), and gives up when that is
  // cancelled.
  bool metering = false;
};

struct StoreKind {
  std::string name;  // letters and digits
  std::function<std::unique_ptr<StoreWorld>()> make_world;
  Exceptions exceptions = {};

  // How a failed test shows it.
  friend void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }
};

// The stores that the suites are run on. Defined by the test program.
std::vector<StoreKind> StoreKinds();

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_STORE_WORLD_H_
