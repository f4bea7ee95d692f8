#include "tests/bench/server/in_process_peers.h"

#include <geos_c.h>
#include <sqlite3.h>

#include <cstdint>
#include <iterator>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"
#include "tests/bench/server/wkb.h"

#ifdef HYPERMAP_BENCH_BOOST
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#endif
#ifdef HYPERMAP_BENCH_SPATIALITE
#include <spatialite.h>
#endif

namespace hypermap::bench {
namespace {

// A database in memory with one prepared query.
class Sqlite {
 public:
  Sqlite() { sqlite3_open(":memory:", &handle_); }
  ~Sqlite() {
    for (sqlite3_stmt* statement : {insert_, select_}) sqlite3_finalize(statement);
    sqlite3_close(handle_);
  }
  Sqlite(const Sqlite&) = delete;
  Sqlite& operator=(const Sqlite&) = delete;

  absl::Status Execute(const char* sql) {
    return sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr) == SQLITE_OK ? absl::OkStatus()
                                                                              : Error();
  }
  absl::Status Prepare(const char* sql, sqlite3_stmt** statement) {
    return sqlite3_prepare_v2(handle_, sql, -1, statement, nullptr) == SQLITE_OK ? absl::OkStatus()
                                                                                 : Error();
  }
  absl::Status PrepareInsert(const char* sql) { return Prepare(sql, &insert_); }
  absl::Status PrepareSelect(const char* sql) { return Prepare(sql, &select_); }
  absl::Status Insert() {
    const int code = sqlite3_step(insert_);
    sqlite3_reset(insert_);
    return code == SQLITE_DONE ? absl::OkStatus() : Error();
  }
  sqlite3* handle() { return handle_; }
  sqlite3_stmt* insert() { return insert_; }
  sqlite3_stmt* select() { return select_; }

 private:
  absl::Status Error() const {
    return absl::InternalError(absl::StrCat("SQLite: ", sqlite3_errmsg(handle_)));
  }

  sqlite3* handle_ = nullptr;
  sqlite3_stmt* insert_ = nullptr;
  sqlite3_stmt* select_ = nullptr;
};

class SqliteRTree final : public InProcessPeer {
 public:
  static absl::StatusOr<std::unique_ptr<InProcessPeer>> Make(const GeneratedSite& site) {
    auto peer = std::make_unique<SqliteRTree>();
    Sqlite& db = peer->database_;
    absl::Status status =
        db.Execute("CREATE VIRTUAL TABLE boxes USING rtree(id, min_x, max_x, min_y, max_y); BEGIN");
    if (status.ok()) status = db.PrepareInsert("INSERT INTO boxes VALUES (?, ?, ?, ?, ?)");
    for (int64_t i = 0; status.ok() && i < site.num_objects(); ++i) {
      peer->polygons_.push_back(site.Object(i).shape.polygon());
      const Box& box = peer->polygons_.back().bounds();
      sqlite3_bind_int64(db.insert(), 1, i);
      sqlite3_bind_double(db.insert(), 2, box.min.x);
      sqlite3_bind_double(db.insert(), 3, box.max.x);
      sqlite3_bind_double(db.insert(), 4, box.min.y);
      sqlite3_bind_double(db.insert(), 5, box.max.y);
      status = db.Insert();
    }
    if (status.ok()) status = db.Execute("COMMIT");
    if (status.ok()) {
      status = db.PrepareSelect(
          "SELECT id FROM boxes WHERE min_x <= ?1 AND max_x >= ?1 AND min_y <= ?2 AND "
          "max_y >= ?2");
    }
    HYPERMAP_RETURN_IF_ERROR(status);
    return peer;
  }
  int CountAt(const Point& p) override {
    sqlite3_stmt* const select = database_.select();
    sqlite3_bind_double(select, 1, p.x);
    sqlite3_bind_double(select, 2, p.y);
    int count = 0;
    while (sqlite3_step(select) == SQLITE_ROW) {
      count += Covers(polygons_[sqlite3_column_int64(select, 0)], p) ? 1 : 0;
    }
    sqlite3_reset(select);
    return count;
  }

 private:
  Sqlite database_;
  std::vector<Polygon> polygons_;
};

class GeosTree final : public InProcessPeer {
 public:
  static absl::StatusOr<std::unique_ptr<InProcessPeer>> Make(const GeneratedSite& site) {
    auto peer = std::make_unique<GeosTree>();
    GEOSContextHandle_t geos = peer->geos_;
    GEOSWKBReader* const reader = GEOSWKBReader_create_r(geos);
    peer->objects_.resize(site.num_objects());
    for (int64_t i = 0; i < site.num_objects(); ++i) {
      const std::string wkb = ToWkb(site.Object(i).shape.polygon());
      Object& object = peer->objects_[i];
      object.geometry = GEOSWKBReader_read_r(
          geos, reader, reinterpret_cast<const unsigned char*>(wkb.data()), wkb.size());
      GEOSSTRtree_insert_r(geos, peer->tree_, object.geometry, &object);
    }
    GEOSWKBReader_destroy_r(geos, reader);
    return peer;
  }
  GeosTree() : geos_(GEOS_init_r()), tree_(GEOSSTRtree_create_r(geos_, 10)) {}
  ~GeosTree() override {
    GEOSSTRtree_destroy_r(geos_, tree_);
    for (const Object& object : objects_) {
      GEOSPreparedGeom_destroy_r(geos_, object.prepared);
      GEOSGeom_destroy_r(geos_, object.geometry);
    }
    GEOS_finish_r(geos_);
  }
  int CountAt(const Point& p) override {
    Question question{this, GEOSGeom_createPointFromXY_r(geos_, p.x, p.y), 0};
    GEOSSTRtree_query_r(geos_, tree_, question.point, Visit, &question);
    GEOSGeom_destroy_r(geos_, question.point);
    return question.count;
  }

 private:
  struct Object {
    GEOSGeometry* geometry = nullptr;
    const GEOSPreparedGeometry* prepared = nullptr;  // made at its first test
  };
  struct Question {
    GeosTree* peer;
    GEOSGeometry* point;
    int count;
  };
  static void Visit(void* item, void* user_data) {
    auto* const object = static_cast<Object*>(item);
    auto* const question = static_cast<Question*>(user_data);
    GEOSContextHandle_t geos = question->peer->geos_;
    if (object->prepared == nullptr) object->prepared = GEOSPrepare_r(geos, object->geometry);
    question->count += GEOSPreparedCovers_r(geos, object->prepared, question->point) == 1 ? 1 : 0;
  }

  GEOSContextHandle_t geos_;
  GEOSSTRtree* tree_;
  std::vector<Object> objects_;
};

#ifdef HYPERMAP_BENCH_BOOST
namespace bg = boost::geometry;

class BoostTree final : public InProcessPeer {
 public:
  static absl::StatusOr<std::unique_ptr<InProcessPeer>> Make(const GeneratedSite& site) {
    auto peer = std::make_unique<BoostTree>();
    std::vector<Value> values;
    for (int64_t i = 0; i < site.num_objects(); ++i) {
      BoostPolygon polygon;
      const SemanticObject object = site.Object(i);
      for (const Point& p : object.shape.polygon().outer()) {
        bg::append(polygon.outer(), BoostPoint(p.x, p.y));
      }
      values.emplace_back(bg::return_envelope<BoostBox>(polygon), peer->polygons_.size());
      peer->polygons_.push_back(std::move(polygon));
    }
    // A tree that is made from a range is packed.
    peer->tree_ = Tree(values);
    return peer;
  }
  int CountAt(const Point& p) override {
    const BoostPoint point(p.x, p.y);
    candidates_.clear();
    tree_.query(bg::index::intersects(point), std::back_inserter(candidates_));
    int count = 0;
    for (const Value& candidate : candidates_) {
      count += bg::covered_by(point, polygons_[candidate.second]) ? 1 : 0;
    }
    return count;
  }

 private:
  using BoostPoint = bg::model::d2::point_xy<double>;
  using BoostBox = bg::model::box<BoostPoint>;
  // Like our polygons: counter-clockwise and open.
  using BoostPolygon = bg::model::polygon<BoostPoint, false, false>;
  using Value = std::pair<BoostBox, size_t>;
  using Tree = bg::index::rtree<Value, bg::index::rstar<16>>;

  std::vector<BoostPolygon> polygons_;
  Tree tree_;
  std::vector<Value> candidates_;
};
#endif

#ifdef HYPERMAP_BENCH_SPATIALITE
class Spatialite final : public InProcessPeer {
 public:
  static absl::StatusOr<std::unique_ptr<InProcessPeer>> Make(const GeneratedSite& site) {
    auto peer = std::make_unique<Spatialite>();
    Sqlite& db = peer->database_;
    spatialite_init_ex(db.handle(), peer->cache_, 0);
    absl::Status status = db.Execute(
        "SELECT InitSpatialMetaDataFull(1, 'NONE'); CREATE TABLE objects (id INTEGER PRIMARY KEY);"
        "SELECT AddGeometryColumn('objects', 'geom', -1, 'POLYGON', 'XY');"
        "SELECT CreateSpatialIndex('objects', 'geom'); BEGIN");
    if (status.ok()) {
      status = db.PrepareInsert("INSERT INTO objects VALUES (?, PolyFromWKB(?, -1))");
    }
    for (int64_t i = 0; status.ok() && i < site.num_objects(); ++i) {
      const std::string wkb = ToWkb(site.Object(i).shape.polygon());
      sqlite3_bind_int64(db.insert(), 1, i);
      sqlite3_bind_blob(db.insert(), 2, wkb.data(), static_cast<int>(wkb.size()), SQLITE_STATIC);
      status = db.Insert();
    }
    if (status.ok()) status = db.Execute("COMMIT");
    if (status.ok()) {
      status = db.PrepareSelect(
          "SELECT count(*) FROM idx_objects_geom AS b JOIN objects AS o ON o.id = b.pkid "
          "WHERE b.xmin <= ?1 AND b.xmax >= ?1 AND b.ymin <= ?2 AND b.ymax >= ?2 "
          "AND ST_Intersects(o.geom, MakePoint(?1, ?2))");
    }
    HYPERMAP_RETURN_IF_ERROR(status);
    return peer;
  }
  Spatialite() : cache_(spatialite_alloc_connection()) {}
  ~Spatialite() override { spatialite_cleanup_ex(cache_); }
  int CountAt(const Point& p) override {
    sqlite3_stmt* const select = database_.select();
    sqlite3_bind_double(select, 1, p.x);
    sqlite3_bind_double(select, 2, p.y);
    const int count = sqlite3_step(select) == SQLITE_ROW ? sqlite3_column_int(select, 0) : -1;
    sqlite3_reset(select);
    return count;
  }

 private:
  void* const cache_;
  Sqlite database_;
};
#endif

}  // namespace

std::vector<InProcessPeerKind> InProcessPeerKinds() {
  return {
      {"SQLite R*Tree", SqliteRTree::Make},
      {"GEOS STRtree, prepared", GeosTree::Make},
#ifdef HYPERMAP_BENCH_BOOST
      {"Boost packed R-tree", BoostTree::Make},
#endif
#ifdef HYPERMAP_BENCH_SPATIALITE
      {"SpatiaLite", Spatialite::Make},
#endif
  };
}

std::vector<std::string> MissingInProcessPeers() {
  std::vector<std::string> missing;
#ifndef HYPERMAP_BENCH_BOOST
  missing.emplace_back("Boost packed R-tree");
#endif
#ifndef HYPERMAP_BENCH_SPATIALITE
  missing.emplace_back("SpatiaLite");
#endif
  return missing;
}

}  // namespace hypermap::bench
