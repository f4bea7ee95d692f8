// Runs the conformance suites on the store in memory, so that tests of the server see what other
// stores do.
#include "server/session/testing/memory_map_store.h"

#include <memory>
#include <utility>
#include <vector>

#include "storage/conformance/store_world.h"

namespace hypermap::server {
namespace {

class MemoryWorld : public storage::StoreWorld {
 public:
  std::unique_ptr<storage::MapStore> Open() override {
    return std::make_unique<MemoryMapStore>(disk_.get());
  }

  std::unique_ptr<storage::MapStore> OpenAfterKill() override {
    auto found = std::make_unique<MemoryDisk>();
    found->Restore(disk_->Save());
    killed_ = std::exchange(disk_, std::move(found));
    return Open();
  }

 private:
  std::unique_ptr<MemoryDisk> disk_ = std::make_unique<MemoryDisk>();
  std::unique_ptr<MemoryDisk> killed_;
};

}  // namespace
}  // namespace hypermap::server

namespace hypermap::storage {

std::vector<StoreKind> StoreKinds() {
  return {{"Memory", [] { return std::make_unique<server::MemoryWorld>(); },
           // It keeps what it is given, without a look at it, and charges objects only.
           Exceptions{.content = true, .metering = true}}};
}

}  // namespace hypermap::storage
