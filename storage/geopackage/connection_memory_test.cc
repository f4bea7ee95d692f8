// Tests of the memory that the database connections of a map take, as SQLite tells it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "map/content_bytes.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "storage/history.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

// Keeps the handle of the connection that was opened last.
class OpenedConnections {
 public:
  OpenedConnections() { sqlite3_auto_extension(reinterpret_cast<void (*)()>(Note)); }
  ~OpenedConnections() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(Note)); }
  OpenedConnections(const OpenedConnections&) = delete;
  OpenedConnections& operator=(const OpenedConnections&) = delete;

  static sqlite3* newest() { return newest_; }

 private:
  static int Note(sqlite3* handle, const char** /*error*/, const void* /*api*/) {
    newest_ = handle;
    return SQLITE_OK;
  }

  static inline sqlite3* newest_ = nullptr;
};

int64_t StatusOf(sqlite3* connection, int status) {
  int now = 0;
  int highest = 0;
  EXPECT_EQ(sqlite3_db_status(connection, status, &now, &highest, 0), SQLITE_OK);
  return now;
}

// Bytes of the schema and of the prepared statements, with those that R*Trees prepare.
int64_t SchemaAndStatements(sqlite3* connection) {
  return StatusOf(connection, SQLITE_DBSTATUS_SCHEMA_USED) +
         StatusOf(connection, SQLITE_DBSTATUS_STMT_USED);
}

// The longest name of a layer, which is part of many names in the schema.
std::string LongName(int number) {
  std::string name = absl::StrCat("layer", number);
  name.append(63 - name.size(), 'x');
  return name;
}

LayerSpec SpecOf(LayerKind kind, const std::string& name) {
  if (kind == LayerKind::kSemantic) return SemanticSpec(name);
  return GridSpec(name, kind, PlanarTransform(), 0.05);
}

// Creates layers with the numbers from `begin` to before `end`.
EditBatch Creation(LayerKind kind, int begin, int end) {
  EditBatch batch;
  for (int i = begin; i < end; ++i) batch.edits.push_back(CreateLayer{SpecOf(kind, LongName(i))});
  return batch;
}

EditBatch Deletion(int begin, int end) {
  EditBatch batch;
  for (int i = begin; i < end; ++i) batch.edits.push_back(DeleteLayer{LongName(i)});
  return batch;
}

class ConnectionMemoryTest : public ::testing::Test {
 protected:
  const testing::TemporaryFolder folder_;
  const OpenedConnections connections_;
  std::unique_ptr<MapStore> store_ = OpenStore(folder_ / "data");
};

TEST_F(ConnectionMemoryTest, LayersTakeNoMoreOfTheWriterThanTheyAreCharged) {
  for (const LayerKind kind : {LayerKind::kSemantic, LayerKind::kScalar}) {
    EditedMap map = CreateMap(*store_, absl::StrCat("map", static_cast<int>(kind)));
    sqlite3* const writer = connections_.newest();
    map.Edit({{CreateLayer{SpecOf(kind, "first")}}});
    const Snapshot before = *map.snapshot;
    const int64_t bytes = SchemaAndStatements(writer);
    map.Edit(Creation(kind, 0, 100));
    EXPECT_LE(SchemaAndStatements(writer) - bytes, ContentGrowth(before, *map.snapshot));
  }
}

TEST_F(ConnectionMemoryTest, OpenedMapKeepsNoStatementsThatReadItsLayers) {
  EditedMap map = CreateMap(*store_, "map");
  map.Edit(Creation(LayerKind::kSemantic, 0, 100));
  map.stored.reset();
  auto opened = store_->Open("map");
  ASSERT_TRUE(opened.ok()) << opened.status();
  sqlite3* const writer = connections_.newest();
  ASSERT_TRUE((*opened)->Load().ok());
  // Only the R*Tree of the history keeps some.
  EXPECT_LT(StatusOf(writer, SQLITE_DBSTATUS_STMT_USED), 64 << 10);
}

TEST_F(ConnectionMemoryTest, ReaderForgetsLayersThatWereDeleted) {
  EditedMap map = CreateMap(*store_, "map");
  const auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  sqlite3* const connection = connections_.newest();
  for (int begin = 0; begin < 200; begin += 50) {
    map.Edit(Creation(LayerKind::kSemantic, begin, begin + 50));
    {
      const auto past = (*reader)->At(map.snapshot->revision);
      ASSERT_TRUE(past.ok()) << past.status();
      for (int i = begin; i < begin + 50; ++i) {
        ASSERT_TRUE((*past)->Objects(LongName(i), Box{{0, 0}, {1, 1}}).ok());
      }
    }
    map.Edit(Deletion(begin, begin + 50));
  }
  // Reads the schema again, which has no layers any more.
  ASSERT_TRUE((*reader)->At(map.snapshot->revision).ok());
  EXPECT_LT(SchemaAndStatements(connection), 2 << 20);
}

TEST_F(ConnectionMemoryTest, ReaderKeepsFewPages) {
  EditedMap map = CreateMap(*store_, "map");
  EditBatch batch{{CreateLayer{SemanticSpec("things")}}};
  PutObject put{"things", UnitSquare("cup"), ""};
  put.object.attributes["text"] = std::string(1000, 'x');
  for (int i = 0; i < 2000; ++i) batch.edits.push_back(put);
  map.Edit(batch);
  const auto reader = map.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  sqlite3* const connection = connections_.newest();
  const auto past = (*reader)->At(map.snapshot->revision);
  ASSERT_TRUE(past.ok()) << past.status();
  const auto objects = (*past)->Objects("things");
  ASSERT_TRUE(objects.ok()) << objects.status();
  EXPECT_EQ(objects->size(), 2000u);
  EXPECT_LT(StatusOf(connection, SQLITE_DBSTATUS_CACHE_USED), 512 << 10);
}

}  // namespace
}  // namespace hypermap::storage
