// A client that watches any server gets an error, or events in the order of their revisions.
//
// An input is a WatchResponse in text format whose `coalesced` messages are the stream.
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "client_libs/cpp/watch_decoder.h"
#include "hypermap/v1/watch_service.pb.h"
#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/require.h"

namespace {

using namespace hypermap;  // NOLINT(google-build-using-namespace)

void CheckStream(const v1::WatchResponse& stream, bool with_changes) {
  client::WatchDecoder<v1::WatchResponse> decoder(with_changes);
  std::optional<Revision> told;
  int64_t changes = 0;  // of the messages since the last event
  for (const v1::WatchResponse& message : stream.coalesced()) {
    const auto event = decoder.Take(message);
    REQUIRE(event.ok() || absl::IsInvalidArgument(event.status()));
    if (!event.ok()) return;
    changes += message.changes_size();
    REQUIRE(event->has_value() == !message.more());
    if (!*event) continue;
    REQUIRE(!told || (*event)->snapshot || (*event)->revision >= *told);
    REQUIRE((*event)->num_changes == changes);
    REQUIRE(decoder.revision() == (*event)->revision);
    told = (*event)->revision;
    changes = 0;
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  v1::WatchResponse stream;
  return fuzz::MutateText(&stream, data, size, max_size, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  v1::WatchResponse stream;
  if (!fuzz::ParseText(data, size, &stream)) return -1;
  CheckStream(stream, /*with_changes=*/true);
  CheckStream(stream, /*with_changes=*/false);
  return 0;
}
