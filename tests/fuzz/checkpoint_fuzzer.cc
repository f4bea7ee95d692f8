// Any bytes decode to a state of each fusion strategy or to DATA_LOSS. A decoded state is encoded,
// and decodes to one that shows the same objects and has the same bytes.
//
// Mutations keep the CBOR well-formed; they begin with the state after a few frames of two boxes,
// so that the target needs no seeds.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "map/fusion/strategy.h"
#include "map/fusion/testing/scene.h"
#include "tests/fuzz/mutate_json.h"
#include "tests/fuzz/require.h"

namespace {

using hypermap::fuzz::Rng;
using namespace hypermap::fusion;  // NOLINT(google-build-using-namespace)

// States with few cells are small.
constexpr char kLargeCells[] = R"({"fine_cell_m": 0.1, "coarse_cell_m": 0.2})";

using Strategies = std::vector<std::unique_ptr<Strategy>>;

const Strategies& AllStrategies() {
  static const Strategies& all = *[] {
    auto strategies = std::make_unique<Strategies>();
    for (const std::string& name : StrategyNames()) {
      strategies->push_back(*MakeStrategy(name, name == "evidence" ? kLargeCells : ""));
    }
    return strategies.release();
  }();
  return all;
}

// The encoded state of a strategy that has seen two boxes, one of which an operator has pinned.
std::string StateOfScene(const Strategy& strategy) {
  const std::vector<SceneBox> scene = {{"desk", {{2, -1}, {3, 0}}, {0, 0.7}},
                                       {"chair", {{2, 0.5}, {2.5, 1}}, {0, 0.9}}};
  StatePtr state = strategy.Initial();
  for (int64_t i = 1; i <= 3; ++i) state = strategy.Fold(state, Observe(scene, {}, i), nullptr);
  OperatorFact pin;
  pin.object.label = "desk";
  pin.object.shape = hypermap::Polygon::FromBox(scene[0].footprint);
  pin.track = "operator/1";
  return strategy.Encode(strategy.Fold(state, pin));
}

void CheckState(const Strategy& strategy, absl::string_view bytes) {
  const auto state = strategy.Decode(bytes);
  REQUIRE(state.ok() || absl::IsDataLoss(state.status()));
  if (!state.ok()) return;
  const std::string encoded = strategy.Encode(*state);
  const auto again = strategy.Decode(encoded);
  REQUIRE(again.ok());
  REQUIRE(strategy.Encode(*again) == encoded);
  const std::vector<FusedObject> objects = strategy.Objects(*state);
  const std::vector<FusedObject> same = strategy.Objects(*again);
  REQUIRE(objects.size() == same.size());
  for (size_t i = 0; i < objects.size(); ++i) REQUIRE(objects[i].track == same[i].track);
  REQUIRE(strategy.ByteSize(*state, nullptr) >= 0);
}

// The value that an input encodes, or the state of a strategy if it encodes none. The parser throws
// for excessive sizes even if it is told not to.
nlohmann::json ValueOf(const uint8_t* data, size_t size, unsigned seed) {
  try {
    return nlohmann::json::from_cbor(data, data + size);
  } catch (const nlohmann::json::exception&) {
    const Strategies& all = AllStrategies();
    return nlohmann::json::from_cbor(StateOfScene(*all[seed % all.size()]));
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  Rng rng(seed + 1);
  if (hypermap::fuzz::Below(rng, 4) == 0) return LLVMFuzzerMutate(data, size, max_size);
  nlohmann::json value = ValueOf(data, size, seed);
  for (uint32_t n = 1 + hypermap::fuzz::Below(rng, 3); n > 0; --n) {
    hypermap::fuzz::MutateJson(&value, rng);
  }
  const std::vector<uint8_t> bytes = nlohmann::json::to_cbor(value);
  if (bytes.size() > max_size) return size;
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const absl::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const auto& strategy : AllStrategies()) CheckState(*strategy, bytes);
  return 0;
}
