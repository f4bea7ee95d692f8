#include "storage/postgres/layer_views.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/postgres_store.h"
#include "storage/postgres/testing/database.h"
#include "tests/support/eventually.h"

namespace hypermap::storage::postgres {
namespace {

using ::hypermap::testing::Eventually;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

EditBatch Create(const std::string& layer, const ShapeKinds& kinds = ShapeKinds()) {
  LayerSpec spec = SemanticSpec(layer);
  spec.shape_kinds = kinds;
  return {{CreateLayer{spec}}};
}

EditBatch Put(const std::string& layer, const std::string& label, ObjectId id = 0) {
  SemanticObject object = UnitSquare(label);
  object.id = id;
  return {{PutObject{layer, object}}};
}

class LayerViewsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    if (!Cluster::Shared().HasPostgis()) GTEST_SKIP() << "needs PostGIS";
    database_ = NewDatabase();
    connection_ = Connect(database_);
    store_ = OpenStore(database_);
  }

  // The rows of a query, as PostgreSQL prints them.
  std::vector<std::string> Read(const std::string& sql) {
    absl::StatusOr<Rows> rows = connection_->Query(
        absl::StrCat("SELECT rtrim(ltrim(q::text, '('), ')') FROM (", sql, ") AS q"));
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::vector<std::string> read;
    while (rows.ok() && rows->Next()) read.emplace_back(rows->Text(0));
    return read;
  }

  // The views that PostGIS lists, with their types of geometry, once there are these.
  ::testing::AssertionResult Lists(const std::vector<std::string>& expected) {
    std::vector<std::string> listed;
    const auto is_listed = [&] {
      listed = Read(
          "SELECT f_table_name, type, srid FROM geometry_columns "
          "WHERE f_table_schema = 'hypermap_layers' ORDER BY 1");
      return listed == expected;
    };
    if (Eventually(is_listed)) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << absl::StrJoin(listed, "; ");
  }

  std::string database_;
  std::unique_ptr<Connection> connection_;
  std::unique_ptr<MapStore> store_;
};

TEST_F(LayerViewsTest, EachSemanticLayerHasOneOfItsType) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("things"));
  site.Edit(Create("lanes", {ShapeKind::kLineString}));
  site.Edit(Create("rooms", {ShapeKind::kPolygon}));
  site.Edit(Create("docks", {ShapeKind::kPoint}));
  site.Edit(Create("both", {ShapeKind::kPoint, ShapeKind::kPolygon}));
  site.Edit({{CreateLayer{GridSpec("grid", LayerKind::kOccupancy, PlanarTransform(), 0.1)}}});
  EXPECT_TRUE(Lists({"site/both,GEOMETRY,0", "site/docks,POINT,0", "site/lanes,LINESTRING,0",
                     "site/rooms,POLYGON,0", "site/things,GEOMETRY,0"}));
}

TEST_F(LayerViewsTest, ShowWhatIsThereNow) {
  EditedMap site = CreateMap(*store_, "site");
  EditedMap other = CreateMap(*store_, "other");
  for (EditedMap* const map : {&site, &other}) {
    map->Edit(Create("things"));
    map->Edit(Create("rooms"));
  }
  ASSERT_TRUE(Lists({"other/rooms,GEOMETRY,0", "other/things,GEOMETRY,0", "site/rooms,GEOMETRY,0",
                     "site/things,GEOMETRY,0"}));
  site.Edit(Put("things", "cup"));
  site.Edit(Put("things", "plate"));
  site.Edit(Put("rooms", "kitchen"));
  other.Edit(Put("things", "tree"));
  site.Edit(Put("things", "bowl", 1));
  site.Edit({{DeleteObject{"things", 2}}});
  EXPECT_THAT(Read(R"(SELECT id, label, existence, classes, tags, attributes, height_min,
                        expires_at_ns, version, ST_Area(geom)
                      FROM hypermap_layers."site/things")"),
              ElementsAre(R"(1,bowl,1,{},[],{},,,6,1)"));
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."other/things")"), ElementsAre("tree"));
}

TEST_F(LayerViewsTest, FollowTheirLayersByName) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("things"));
  site.Edit(Put("things", "cup"));
  ASSERT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  // In one commit, so that the view is not dropped between.
  site.Edit({{DeleteLayer{"things"}, CreateLayer{SemanticSpec("things")}}});
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."site/things")"), ElementsAre());
  site.Edit(Put("things", "bowl"));
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."site/things")"), ElementsAre("bowl"));

  site.Edit({{DeleteLayer{"things"}, Create("things", {ShapeKind::kPoint}).edits.front()}});
  EXPECT_TRUE(Lists({"site/things,POINT,0"}));
  site.Edit({{DeleteLayer{"things"}}});
  EXPECT_TRUE(Lists({}));
}

TEST_F(LayerViewsTest, EndWithTheirMap) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("things"));
  ASSERT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  site.stored = nullptr;
  ASSERT_TRUE(store_->Delete("site", "").ok());
  EXPECT_TRUE(Lists({}));
}

TEST_F(LayerViewsTest, AreMadeAtTheNextStartIfPostgisComesLater) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("things"));
  site.Edit(Put("things", "cup"));
  ASSERT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  site.stored = nullptr;
  store_ = nullptr;
  ASSERT_TRUE(connection_->Execute("DROP EXTENSION postgis CASCADE").ok());
  EXPECT_THAT(Read("SELECT relname FROM pg_class "
                   "WHERE relnamespace = 'hypermap_layers'::regnamespace"),
              ElementsAre());
  ASSERT_TRUE(connection_->Execute("CREATE EXTENSION postgis").ok());
  store_ = OpenStore(database_);
  EXPECT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."site/things")"), ElementsAre("cup"));
}

TEST_F(LayerViewsTest, NamesHaveNoDots) {
  EditedMap site = CreateMap(*store_, "a.b");
  site.Edit(Create("c.d_e-F"));
  EXPECT_TRUE(Lists({"a:b/c:d_e-F,GEOMETRY,0"}));
  site.Edit(Put("c.d_e-F", "cup"));
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."a:b/c:d_e-F")"), ElementsAre("cup"));
}

TEST_F(LayerViewsTest, LongNamesAreCutOff) {
  const std::string map(kMaxNameLength, 'm');
  EditedMap site = CreateMap(*store_, map);
  site.Edit(Create("a"));
  site.Edit(Create("b"));
  const std::string start(54, 'm');
  std::vector<std::string> names;
  for (const char* const layer : {"a", "b"}) {
    for (const std::string& digest :
         Read(absl::StrCat("SELECT left(md5('", map, "/", layer, "'), 8)"))) {
      names.push_back(absl::StrCat(start, "/", digest, ",GEOMETRY,0"));
    }
  }
  std::sort(names.begin(), names.end());
  ASSERT_EQ(names.size(), 2);
  EXPECT_TRUE(Lists(names));
}

TEST_F(LayerViewsTest, ReadersKeepNobodyFromEditing) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("read"));
  ASSERT_TRUE(Lists({"site/read,GEOMETRY,0"}));
  const std::unique_ptr<Connection> reader = Connect(database_);
  ASSERT_TRUE(reader->Execute(R"(BEGIN; SELECT * FROM hypermap_layers."site/read")").ok());
  site.Edit({{DeleteLayer{"read"}}});
  site.Edit(Create("other"));
  ASSERT_TRUE(Lists({"site/other,GEOMETRY,0", "site/read,GEOMETRY,0"}));
  EXPECT_EQ(UpdateLayerViews(connection_.get()).code(), absl::StatusCode::kUnavailable);
  ASSERT_TRUE(reader->Execute("ROLLBACK").ok());
  EXPECT_EQ(UpdateLayerViews(connection_.get()), absl::OkStatus());
  EXPECT_TRUE(Lists({"site/other,GEOMETRY,0"}));
}

TEST_F(LayerViewsTest, ViewsOfOthersStay) {
  EditedMap site = CreateMap(*store_, "site");
  site.Edit(Create("things"));
  ASSERT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  Execute(database_, "CREATE VIEW hypermap_layers.mine AS SELECT 1 AS one");
  Execute(database_, R"(CREATE VIEW cups AS SELECT id FROM hypermap_layers."site/things")");
  site.Edit({{DeleteLayer{"things"}}});
  // What others have built upon is kept.
  EXPECT_FALSE(UpdateLayerViews(connection_.get()).ok());
  EXPECT_EQ(QueryNumber(database_, "SELECT count(*) FROM cups"), 0);
  EXPECT_EQ(QueryNumber(database_, "SELECT one FROM hypermap_layers.mine"), 1);
}

TEST_F(LayerViewsTest, ARoleMayReadThemAlone) {
  EditedMap site = CreateMap(*store_, "site");
  ASSERT_TRUE(connection_
                  ->Execute("CREATE ROLE viewer; GRANT USAGE ON SCHEMA hypermap_layers TO viewer; "
                            "ALTER DEFAULT PRIVILEGES IN SCHEMA hypermap_layers "
                            "GRANT SELECT ON TABLES TO viewer")
                  .ok());
  site.Edit(Create("things"));
  site.Edit(Put("things", "cup"));
  ASSERT_TRUE(Lists({"site/things,GEOMETRY,0"}));
  ASSERT_TRUE(connection_->Execute("SET ROLE viewer").ok());
  EXPECT_THAT(Read(R"(SELECT label FROM hypermap_layers."site/things")"), ElementsAre("cup"));
  EXPECT_EQ(connection_->Query("SELECT 1 FROM hypermap.objects").status().code(),
            absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(connection_->Execute("RESET ROLE; DROP OWNED BY viewer; DROP ROLE viewer").ok());
}

TEST_F(LayerViewsTest, AServerWithoutThePermissionSaysSo) {
  store_ = nullptr;
  ASSERT_TRUE(connection_
                  ->Execute("DROP SCHEMA hypermap_layers; CREATE ROLE server LOGIN; "
                            "GRANT USAGE ON SCHEMA hypermap TO server; "
                            "GRANT ALL ON ALL TABLES IN SCHEMA hypermap TO server")
                  .ok());
  PostgresOptions options;
  options.target = absl::StrCat(database_, " user=server");
  auto store = OpenPostgresStore(options);
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_THAT((*store)->notes(), Contains(HasSubstr("layers have no views for other programs")));
  EditedMap site = CreateMap(**store, "site");
  site.Edit(Create("things"));
  site.stored = nullptr;
  *store = nullptr;
  ASSERT_TRUE(connection_->Execute("DROP OWNED BY server; DROP ROLE server").ok());
}

}  // namespace
}  // namespace hypermap::storage::postgres
