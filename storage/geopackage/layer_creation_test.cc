// Tests of commits that create very many layers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

// Counts the statements that the connections opened meanwhile run, with those that SQLite runs for
// itself.
class StatementCounter {
 public:
  StatementCounter() {
    count_ = 0;
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(Attach));
  }
  ~StatementCounter() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(Attach)); }
  StatementCounter(const StatementCounter&) = delete;
  StatementCounter& operator=(const StatementCounter&) = delete;

  static int64_t count() { return count_; }

 private:
  static int Attach(sqlite3* handle, const char** /*error*/, const void* /*api*/) {
    return sqlite3_trace_v2(handle, SQLITE_TRACE_STMT, Count, nullptr);
  }
  static int Count(unsigned /*kind*/, void* /*context*/, void* /*statement*/, void* /*text*/) {
    ++count_;
    return 0;
  }

  static inline int64_t count_ = 0;
};

// Creates layers whose names differ only in characters that names of tables do not have, so that
// each wants the same name for its table.
EditBatch CreationOfLayers(int number) {
  EditBatch batch;
  for (int i = 0; i < number; ++i) {
    std::string name = "l";
    for (int bit = 0; bit < 10; ++bit) name.push_back((i >> bit) % 2 == 0 ? '-' : '.');
    batch.edits.push_back(
        CreateLayer{GridSpec(name, LayerKind::kOccupancy, PlanarTransform(), 0.05)});
  }
  return batch;
}

class LayerCreationTest : public ::testing::Test {
 protected:
  const testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_ = OpenStore(folder_ / "data");
};

TEST_F(LayerCreationTest, StatementsGrowWithTheLayers) {
  const StatementCounter counter;
  const auto statements_for = [&](int number) {
    EditedMap map = CreateMap(*store_, absl::StrCat("map", number));
    const int64_t before = counter.count();
    map.Edit(CreationOfLayers(number));
    return counter.count() - before;
  };
  const int64_t few = statements_for(50);
  EXPECT_GT(few, 50);
  EXPECT_LE(statements_for(200), 5 * few);
}

TEST_F(LayerCreationTest, LayersOfLikeNamesHaveTheirOwnTables) {
  EditedMap map = CreateMap(*store_, "map");
  map.Edit(CreationOfLayers(40));
  // In one commit with a layer that makes room for another one.
  map.Edit({{DeleteLayer{"l----------"}, CreateLayer{SemanticSpec("l_---------")},
             PutObject{"l_---------", UnitSquare("cup")}}});
  map.stored.reset();
  auto stored = store_->Open("map");
  ASSERT_TRUE(stored.ok()) << stored.status();
  const absl::StatusOr<SnapshotPtr> loaded = (*stored)->Load();
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ExpectSame(**loaded, *map.snapshot);
}

TEST_F(LayerCreationTest, AWriteGivenUpAnywhereLeavesTheMapAsItWas) {
  EditedMap map = CreateMap(*store_, "map");
  map.Edit({{CreateLayer{SemanticSpec("first")}}});
  EditBatch batch = CreationOfLayers(5);
  batch.edits.push_back(CreateLayer{SemanticSpec("things")});
  batch.edits.push_back(PutObject{"things", UnitSquare("cup")});
  batch.edits.push_back(DeleteLayer{"first"});
  const Commit commit = MakeCommit(*map.snapshot, batch);
  EXPECT_GT(TimesCancelled([&] {
              const absl::Status status = map.stored->Write({commit});
              const ScopedCancellation to_the_end(nullptr);
              const absl::StatusOr<SnapshotPtr> loaded = map.stored->Load();
              EXPECT_TRUE(loaded.ok()) << loaded.status();
              if (loaded.ok()) {
                ExpectSame(**loaded, status.ok() ? *commit.applied.snapshot : *map.snapshot);
              }
              return status;
            }),
            4);
  map.snapshot = commit.applied.snapshot;
  map.Edit({{PutObject{"things", UnitSquare("mug")}}});
}

}  // namespace
}  // namespace hypermap::storage
