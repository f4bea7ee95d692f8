#include "client_libs/cli/cell_values.h"

#include <optional>
#include <utility>

#include "absl/status/statusor.h"
#include "client_libs/cli/text_table.h"
#include "map/layers/layer_registry.h"
#include "map/values/value_query.h"

namespace hypermap::cli {
namespace {

LayerSpec SpecOf(LayerKind kind) {
  LayerSpec spec;
  spec.kind = kind;
  return spec;
}

}  // namespace

LayerProperties PropertiesOfKind(LayerKind kind) { return PropertiesOf(SpecOf(kind)); }

CellValues::CellValues(LayerKind kind) : CellValues(SpecOf(kind), PropertiesOfKind(kind)) {}

CellValues::CellValues(const LayerSpec& spec, LayerProperties properties)
    : properties_(std::move(properties)), domain_(MakeCellDomain(spec)) {}

std::string CellValues::Word(double value) const {
  for (const WordOfValue& named : properties_.words_of_values) {
    if (named.value == value) return named.word;
  }
  if (!domain_) return "";
  const absl::StatusOr<CellCode> code = domain_->Encode(value);
  if (!code.ok()) return "";
  // The properties do not tell the ranges of the other words, so each is tried as a query.
  for (const std::string& word : properties_.words) {
    const absl::StatusOr<ValueQuery> query = ParseValueQuery(word);
    if (!query.ok()) continue;
    const std::optional<CodePredicate> matches = domain_->Match(*query);
    if (matches && (*matches)(*code)) return word;
  }
  return "";
}

std::string CellValues::Describe(double value) const {
  if (properties_.is_binary) {
    if (std::string word = Word(value); !word.empty()) return word;
  }
  return FormatNumber(value, 4);
}

}  // namespace hypermap::cli
