// Lower bound for the storage benchmarks: writes the rows that a commit of new objects makes in a
// map's tables, with prepared SQLite statements and nothing else.
#ifndef HYPERMAP_TESTS_BENCH_BARE_MAP_H_
#define HYPERMAP_TESTS_BENCH_BARE_MAP_H_

#include <sqlite3.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hypermap {

// The stored members of an object, in the form in which they are bound to a statement.
struct BareRow {
  int64_t id = 0;
  std::string geometry;  // GeoPackageBinary, little-endian, with an XY envelope
  std::string label;
  double existence = 1.0;
};

// The file of a map, opened directly. Ends the program on any error of SQLite.
class BareMap {
 public:
  // Opens the file of a map that no other connection uses. `table` is the table of its only
  // semantic layer, whose lineage is 1.
  BareMap(const std::string& path, const std::string& table);
  ~BareMap();
  BareMap(const BareMap&) = delete;
  BareMap& operator=(const BareMap&) = delete;

  int64_t next_id() const { return next_id_; }

  // Writes in one durable transaction: the objects, the changes, the revision, the GeoPackage's
  // entry of the layer, and with a request id its receipt. The ids of the rows are next_id() and
  // the following numbers.
  void Commit(const BareRow* begin, const BareRow* end, const std::string& request_id = "");

 private:
  sqlite3_stmt* Prepare(const std::string& sql);
  int64_t Query(const std::string& sql);

  sqlite3* database_ = nullptr;
  std::vector<sqlite3_stmt*> statements_;
  sqlite3_stmt* begin_;
  sqlite3_stmt* put_;
  sqlite3_stmt* change_;
  sqlite3_stmt* layer_revision_;
  sqlite3_stmt* revision_row_;
  sqlite3_stmt* receipt_;
  sqlite3_stmt* contents_;
  sqlite3_stmt* metadata_;
  sqlite3_stmt* commit_;
  int64_t revision_ = 0;
  int64_t next_id_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_TESTS_BENCH_BARE_MAP_H_
