#include <optional>

#include "server/session/testing/memory_map_store.h"
#include "tests/histories/volume.h"

namespace hypermap::histories {
namespace {

class MemoryVolume : public Volume {
 public:
  absl::StatusOr<std::unique_ptr<storage::MapStore>> Open() override {
    return std::make_unique<server::MemoryMapStore>(&disk_);
  }
  // There are no files.
  void set_faults(bool /*faults*/) override {}
  void BeginWrite(bool syncs) override {
    syncs_ = syncs;
    if (!syncs && !synced_) synced_ = disk_.Save();
  }
  void EndWrite() override {
    if (syncs_) synced_.reset();
  }
  void Crash() override { left_ = synced_ ? *synced_ : disk_.Save(); }
  // The write is atomic: Crash before it, or after it.
  void CrashDuringLastWrite() override { Crash(); }
  void Restart() override {
    disk_.Restore(left_);
    synced_.reset();
  }

 private:
  server::MemoryDisk disk_;
  bool syncs_ = true;
  // The content that is synced, if that is not all.
  std::optional<server::MemoryDisk::Image> synced_;
  server::MemoryDisk::Image left_;
};

}  // namespace

std::unique_ptr<Volume> MakeMemoryVolume() { return std::make_unique<MemoryVolume>(); }

}  // namespace hypermap::histories
