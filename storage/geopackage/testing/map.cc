#include "storage/geopackage/testing/map.h"

#include <fstream>
#include <iterator>

#include "gtest/gtest.h"
#include "storage/geopackage/spatial_functions.h"

namespace hypermap::storage {

std::unique_ptr<MapStore> OpenStore(const std::string& folder, const GeoPackageOptions& options) {
  absl::StatusOr<std::unique_ptr<MapStore>> store = OpenGeoPackageStore(folder, options);
  EXPECT_TRUE(store.ok()) << store.status();
  return store.ok() ? *std::move(store) : nullptr;
}

std::unique_ptr<Database> Connect(const std::string& path) {
  auto database = Database::Open(path, Database::OpenMode::kCreate, absl::ZeroDuration());
  EXPECT_TRUE(database.ok()) << database.status();
  if (!database.ok()) return nullptr;
  EXPECT_TRUE(RegisterSpatialFunctions(database->get()).ok());
  return *std::move(database);
}

std::vector<int64_t> PagesOf(const std::string& path, const std::string& table, bool only_leaves) {
  const auto database = Connect(path);
  Statement select = *database->Prepare(
      "SELECT pageno FROM dbstat WHERE name = ? AND (pagetype = 'leaf' OR NOT ?) ORDER BY pageno");
  select.Bind(table, only_leaves);
  std::vector<int64_t> pages;
  while (*select.Step()) pages.push_back(select.Int64(0));
  return pages;
}

void FlipBitOfPage(testing::Rng& rng, const std::string& path, int64_t page) {
  constexpr int kPageSize = 4096;
  std::string bytes = ReadFile(path);
  const int64_t at = (page - 1) * kPageSize + testing::UniformInt(rng, 0, kPageSize - 1);
  bytes[at] = static_cast<char>(bytes[at] ^ 1 << testing::UniformInt(rng, 0, 7));
  WriteFile(path, bytes);
}

void WriteFile(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
}

std::string ReadFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace hypermap::storage
