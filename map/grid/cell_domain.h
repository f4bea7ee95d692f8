// Defines the values of a grid kind's cells.
#ifndef HYPERMAP_MAP_GRID_CELL_DOMAIN_H_
#define HYPERMAP_MAP_GRID_CELL_DOMAIN_H_

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/grid/tile.h"
#include "map/values/value_query.h"

namespace hypermap {

// Returns whether a stored code matches a query.
using CodePredicate = std::function<bool(CellCode)>;

// A closed range.
struct CellValueRange {
  double min = 0.0;
  double max = 0.0;

  friend bool operator==(const CellValueRange&, const CellValueRange&) = default;
};

// A word of queries that stands for one value.
struct WordOfValue {
  std::string word;
  double value = 0.0;

  friend bool operator==(const WordOfValue&, const WordOfValue&) = default;
};

class CellDomain {
 public:
  virtual ~CellDomain() = default;

  // Returns the code of a value, rounded to the precision of the kind. INVALID_ARGUMENT for values
  // that the kind does not have.
  virtual absl::StatusOr<CellCode> Encode(double value) const = 0;

  // Returns the value of a known code.
  virtual double Decode(CellCode code) const = 0;

  // u of the paper: converts a query to a predicate on codes; nullopt if the kind does not support
  // it.
  virtual std::optional<CodePredicate> Match(const ValueQuery& query) const = 0;

  // The least and the greatest value; nullopt: any number.
  virtual std::optional<CellValueRange> Range() const = 0;
  // The words that Match supports, in the order in which clients should list them.
  virtual std::vector<std::string> Words() const = 0;
  // The words of Words() that match exactly one value. A word that matches a range of values, such
  // as "free", or no value, such as "unknown", is not among them.
  virtual std::vector<WordOfValue> WordsOfValues() const { return {}; }
  // Returns whether known cells have one of two values only.
  virtual bool IsBinary() const { return false; }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_DOMAIN_H_
