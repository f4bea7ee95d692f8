// A replica that carries out the messages of any server gets an error or a map that answers: every
// object is found by its id and lies within the bounds of its layer.
//
// An input is a ReplicateResponse in text format whose `coalesced` messages are the stream.
#include <cstddef>
#include <cstdint>
#include <memory>

#include "client_libs/cpp/replica/mirrored_map.h"
#include "client_libs/cpp/watch_decoder.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/query/query.h"
#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/require.h"

namespace {

using namespace hypermap;  // NOLINT(google-build-using-namespace)

void CheckAnswers(const SnapshotPtr& map) {
  for (const auto& [name, layer] : map->layers) {
    REQUIRE(layer->spec().name == name);
    REQUIRE(layer->ByteSize() >= 0);
    const auto* semantic = map->FindSemantic(name);
    if (semantic == nullptr) continue;
    for (const ObjectPtr& object : semantic->Objects()) {
      REQUIRE(semantic->Find(object->id) == object);
      const Box bounds = object->shape.bounds();
      REQUIRE(layer->Bounds().Covers(bounds.min) && layer->Bounds().Covers(bounds.max));
    }
  }
  for (const Point& p : {Point{0, 0}, Point{1e9, -1e9}}) REQUIRE(ContentAt(*map, {}, p, 1.0).ok());
  const auto reader = ContentIn(map, {}, Polygon::FromBox({{-2, -2}, {2, 2}}));
  REQUIRE(reader.ok());
  while (!(*reader)->done()) (*reader)->Next(100);
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  v1::ReplicateResponse stream;
  return fuzz::MutateText(&stream, data, size, max_size, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  v1::ReplicateResponse stream;
  if (!fuzz::ParseText(data, size, &stream)) return -1;
  client::WatchDecoder<v1::ReplicateResponse> decoder(/*with_changes=*/true);
  auto map = std::make_shared<const Snapshot>();
  for (const v1::ReplicateResponse& message : stream.coalesced()) {
    const auto event = decoder.Take(message);
    REQUIRE(event.ok() || absl::IsInvalidArgument(event.status()));
    if (!event.ok()) break;
    if (!*event) continue;
    const auto after = client::After(*map, **event);
    REQUIRE(after.ok() || absl::IsInternal(after.status()));
    if (!after.ok()) break;
    map = *after;
    CheckAnswers(map);
  }
  return 0;
}
