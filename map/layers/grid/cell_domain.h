// What the cells of a grid kind may hold: the value definition of a grid layer.
#ifndef HYPERMAP_MAP_LAYERS_GRID_CELL_DOMAIN_H_
#define HYPERMAP_MAP_LAYERS_GRID_CELL_DOMAIN_H_

#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "map/layers/grid/tile.h"
#include "map/values/value_query.h"

namespace hypermap {

// Tells whether a stored code matches a value that was asked for.
using CodePredicate = std::function<bool(CellCode)>;

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
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_CELL_DOMAIN_H_
