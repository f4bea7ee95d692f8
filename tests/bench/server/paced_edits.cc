#include "tests/bench/server/paced_edits.h"

#include <algorithm>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "tests/bench/server/map_files.h"

namespace hypermap::bench {
namespace {

// One writer of the changes at a given rate. Makes edit i of `count` at its scheduled time, or as
// soon as possible after it.
absl::Status WritePaced(const Channels& channel, const Calls& calls, absl::Time start,
                        absl::Duration step, int count) {
  for (int i = 0; i < count; ++i) {
    absl::SleepFor(start + i * step - absl::Now());
    const auto answer = Ask(channel, calls, 1);
    HYPERMAP_RETURN_IF_ERROR(answer.status());
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<int64_t> NewestRevision(const Channels& channels) {
  v1::GetMapRequest request;
  request.set_map(kSiteMap);
  const auto answers =
      Ask(channels, {"/hypermap.v1.CatalogService/GetMap", false, InTurn({ToBytes(request)})}, 1);
  HYPERMAP_RETURN_IF_ERROR(answers.status());
  v1::GetMapResponse response;
  if (!response.ParseFromString(answers->front())) return absl::InternalError("GetMap");
  return response.map().revision();
}

absl::StatusOr<PacedEdits> MakePacedEdits(const std::string& address, const Calls& calls,
                                          int writers, int per_s, absl::Duration length) {
  const absl::Duration step = absl::Seconds(writers) / per_s;
  const int count = std::max(1, static_cast<int>(length / step));
  const absl::Time start = absl::Now();
  std::vector<absl::Status> statuses(writers);
  std::vector<std::thread> threads;
  threads.reserve(writers);
  for (int i = 0; i < writers; ++i) {
    threads.emplace_back([&, i] {
      statuses[i] =
          WritePaced(OpenChannels(address, 1), calls, start + i * step / writers, step, count);
    });
  }
  for (std::thread& thread : threads) thread.join();
  const int64_t made = int64_t{writers} * count;
  const PacedEdits edits{made,
                         static_cast<double>(made) / absl::ToDoubleSeconds(absl::Now() - start)};
  for (const absl::Status& status : statuses) HYPERMAP_RETURN_IF_ERROR(status);
  return edits;
}

}  // namespace hypermap::bench
