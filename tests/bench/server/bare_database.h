// Lower bound for edits in PostgreSQL: writes the rows that a group of edits makes in the tables of
// a map, with prepared statements of libpq and nothing else.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_BARE_DATABASE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_BARE_DATABASE_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/objects/semantic_object.h"

// libpq's own type.
struct pg_conn;

namespace hypermap::bench {

// An edit that replaces an object, as its columns are stored.
struct BareEdit {
  SemanticObject object;
  std::string shape;  // the blob of a GeoPackage
  std::string request_id;
};

// The rows of the only map of a database, which no server has open. The map has one layer.
class BareDatabase {
 public:
  static absl::StatusOr<std::unique_ptr<BareDatabase>> Open(const std::string& target);

  // Writes in one transaction and one round trip, each edit as a revision: the end of the version
  // before, the new version, the change, the revision of the layer, the receipt and the revision;
  // and the row of the map, on the condition by which an owner is fenced off.
  absl::Status Commit(absl::Span<const BareEdit> edits);

 private:
  struct Closer {
    void operator()(pg_conn* connection) const;
  };
  explicit BareDatabase(pg_conn* connection) : connection_(connection) {}
  absl::Status ReadMap();
  absl::Status ReadAnswers();

  const std::unique_ptr<pg_conn, Closer> connection_;
  // The row of the map.
  int64_t map_ = 0;
  int64_t epoch_ = 0;
  int64_t last_write_ = 0;
  int64_t revision_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_BARE_DATABASE_H_
