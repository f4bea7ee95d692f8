// What the cells of a grid kind may hold: the value definition of a grid layer.
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

// Tells whether a stored code matches a value that was asked for.
using CodePredicate = std::function<bool(CellCode)>;

// Both ends included.
struct CellValueRange {
  double min = 0.0;
  double max = 0.0;

  friend bool operator==(const CellValueRange&, const CellValueRange&) = default;
};

class CellDomain {
 public:
  virtual ~CellDomain() = default;

  // The code that stands for a value, rounded to what the kind can hold. INVALID_ARGUMENT for
  // values that the kind does not have.
  virtual absl::StatusOr<CellCode> Encode(double value) const = 0;

  // The value of a known code.
  virtual double Decode(CellCode code) const = 0;

  // u of the paper: the common value as a predicate on codes; nullopt when the kind can't take it.
  virtual std::optional<CodePredicate> Match(const ValueQuery& query) const = 0;

  // The least and the largest value; nullopt: any number.
  virtual std::optional<CellValueRange> Range() const = 0;
  // The words that Match takes, in the order in which they are told.
  virtual std::vector<std::string> Words() const = 0;
  // Whether a known cell holds one of two values.
  virtual bool IsBinary() const { return false; }
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_DOMAIN_H_
