#include "storage/geopackage/time_mark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/time_mark.h"
#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;

TEST(TimeMarkTableTest, C1TimeThatGoesBackIsDamage) {
  const testing::TemporaryFolder folder;
  const std::unique_ptr<MapStore> store = OpenStore(folder.path());
  const EditedMap map = CreateMap(*store, "site");
  ASSERT_TRUE(map.stored->AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  ASSERT_TRUE(map.stored->AddTimeMark(MarkAt(20), absl::ZeroDuration()).ok());
  ASSERT_TRUE(Connect(folder / "site.gpkg")
                  ->Execute("UPDATE hypermap_time_marks SET passed_ns = 1 WHERE revision = 20")
                  .ok());
  const absl::Status status = map.stored->TimeMarks().status();
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("hypermap_time_marks"));
}

}  // namespace
}  // namespace hypermap::storage
