// Tests that a compaction which fails changes nothing. SQLite ends a transaction because of some
// errors, so that a statement which is run after one would be committed by itself.
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/string_view.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/testing/faulty_files.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

constexpr int kVersions = 6;

// A map with an object of which each commit has replaced a version.
void MakeVersions(const std::string& folder) {
  const auto store = OpenStore(folder);
  EditedMap map = CreateMap(*store, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  for (int i = 0; i < kVersions; ++i) {
    SemanticObject object = UnitSquare("chair");
    object.id = 1;
    map.Edit({{PutObject{"s", object, ""}}});
  }
}

TEST(CompactionFaultTest, VersionsAndTheirBoxesGoTogether) {
  bool has_failed = true;
  int first = 1;
  for (; has_failed && !HasFailure(); ++first) {
    SCOPED_TRACE(::testing::Message() << "read " << first << " fails");
    const testing::TemporaryFolder folder;
    MakeVersions(folder.path());
    {
      FaultyFiles files(folder.path());
      // A check at the opening would leave all pages in memory.
      GeoPackageOptions options;
      options.max_checked_bytes = 0;
      const auto store = OpenStore(folder.path(), options);
      const auto map = store->Open("site");
      ASSERT_TRUE(map.ok()) << map.status();
      files.Arm([](absl::string_view name) { return absl::StartsWith(name, "site.gpkg"); },
                {FileCall::kRead, SQLITE_IOERR_READ, first});
      const auto more = (*map)->Compact(kVersions, absl::InfinitePast(), 100);
      has_failed = files.num_failed() > 0;
      files.Disarm();
      EXPECT_EQ(more.ok(), !has_failed) << more.status();
    }
    const auto report = CheckMapFile(folder / "site.gpkg", nullptr);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_TRUE(report->is_clean()) << Describe(report->findings.front());
  }
  EXPECT_GT(first, 3);
}

}  // namespace
}  // namespace hypermap::storage
