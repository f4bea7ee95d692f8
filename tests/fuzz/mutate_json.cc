#include "tests/fuzz/mutate_json.h"

#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace hypermap::fuzz {
namespace {

using nlohmann::json;

void CollectValues(json* value, std::vector<json*>* values) {
  values->push_back(value);
  if (!value->is_structured()) return;
  for (json& element : *value) CollectValues(&element, values);
}

json AnyValue(Rng& rng) {
  switch (Below(rng, 6)) {
    case 0:
      return nullptr;
    case 1:
      return RandomInteger(rng);
    case 2:
      return RandomDouble(rng);
    case 3:
      return json::array();
    case 4:
      return json::object();
    default:
      return MutatedText("", rng);
  }
}

void MutateElements(json* value, Rng& rng) {
  const auto any = [&] { return std::next(value->begin(), Below(rng, value->size())); };
  switch (Below(rng, 3)) {
    case 0:
      value->erase(any());
      break;
    case 1:
      if (value->is_array()) value->push_back(json(*any()));
      break;
    default:
      std::swap(*any(), *any());
  }
}

void MutateBinary(json::binary_t* bytes, Rng& rng) {
  constexpr size_t kRoom = 16;
  const size_t size = bytes->size();
  bytes->resize(size + kRoom);
  bytes->resize(LLVMFuzzerMutate(bytes->data(), size, size + Below(rng, kRoom) + 1));
}

}  // namespace

void MutateJson(json* value, Rng& rng) {
  std::vector<json*> values;
  CollectValues(value, &values);
  json* const chosen = values[Below(rng, values.size())];
  if (Below(rng, 10) == 0) {
    *chosen = AnyValue(rng);
  } else if (chosen->is_structured() && !chosen->empty()) {
    MutateElements(chosen, rng);
  } else if (chosen->is_binary()) {
    MutateBinary(&chosen->get_binary(), rng);
  } else if (chosen->is_string()) {
    *chosen = MutatedText(chosen->get<std::string>(), rng);
  } else if (chosen->is_number_integer()) {
    *chosen = RandomInteger(rng);
  } else if (chosen->is_number()) {
    *chosen = RandomDouble(rng);
  } else if (chosen->is_boolean()) {
    *chosen = !chosen->get<bool>();
  }
}

}  // namespace hypermap::fuzz
