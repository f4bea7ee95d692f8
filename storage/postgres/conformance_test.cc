// Runs the conformance suites on the PostgreSQL store.
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "storage/conformance/store_world.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/postgres/testing/database.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

class PostgresWorld : public StoreWorld {
 public:
  std::unique_ptr<MapStore> Open() override { return postgres::OpenStore(database_); }

  // The sessions of the killed process are still there, as they are for a while.
  std::unique_ptr<MapStore> OpenAfterKill() override { return Open(); }

  // Copies are files of the other store.
  std::unique_ptr<MapStore> OpenCopy(const std::string& path, const std::string& name) override {
    copies_.push_back(std::make_unique<testing::TemporaryFolder>());
    std::filesystem::copy(path, *copies_.back() / name + ".gpkg");
    auto store = OpenGeoPackageStore(copies_.back()->path());
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }

 private:
  const std::string database_ = postgres::NewDatabase();
  std::vector<std::unique_ptr<testing::TemporaryFolder>> copies_;
};

}  // namespace

std::vector<StoreKind> StoreKinds() {
  return {{"Postgres", [] { return std::make_unique<PostgresWorld>(); }}};
}

}  // namespace hypermap::storage
