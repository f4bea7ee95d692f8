// Runs the conformance suites on the GeoPackage store.
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "storage/conformance/store_world.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

class GeoPackageWorld : public StoreWorld {
 public:
  std::unique_ptr<MapStore> Open() override { return OpenStore(folder_->path()); }

  std::unique_ptr<MapStore> OpenAfterKill() override {
    // The files as they are at this moment. The witness in the lock of a map is one of them.
    auto found = std::make_unique<testing::TemporaryFolder>();
    std::filesystem::copy(folder_->path(), found->path(), std::filesystem::copy_options::recursive);
    killed_ = std::exchange(folder_, std::move(found));
    return Open();
  }

  std::unique_ptr<MapStore> OpenCopy(const std::string& path, const std::string& name) override {
    copies_.push_back(std::make_unique<testing::TemporaryFolder>());
    std::filesystem::copy(path, *copies_.back() / name + ".gpkg");
    return OpenStore(copies_.back()->path());
  }

 private:
  std::unique_ptr<testing::TemporaryFolder> folder_ = std::make_unique<testing::TemporaryFolder>();
  std::unique_ptr<testing::TemporaryFolder> killed_;
  std::vector<std::unique_ptr<testing::TemporaryFolder>> copies_;
};

}  // namespace

std::vector<StoreKind> StoreKinds() {
  return {{"GeoPackage", [] { return std::make_unique<GeoPackageWorld>(); }}};
}

}  // namespace hypermap::storage
