#include "tests/bench/server/edited_site.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/edit_calls.h"

namespace hypermap::bench {

EditedSite::EditedSite(const Options& options)
    : options_(options), site_(options.objects), scratch_(options.scratch) {}

absl::Status EditedSite::Open() {
  const absl::StatusOr<std::string> kept = SiteFolder(options_.cache, site_);
  HYPERMAP_RETURN_IF_ERROR(kept.status());
  const std::string ours = scratch_.path() + "/ours";
  const std::string floor = scratch_.path() + "/floor";
  absl::Status status = CopyMaps(*kept, ours);
  if (status.ok()) status = CopyMaps(*kept, floor);
  HYPERMAP_RETURN_IF_ERROR(status);
  auto started = StartHypermap(options_, ours);
  HYPERMAP_RETURN_IF_ERROR(started.status());
  server_ = *std::move(started);
  bare_ = std::make_unique<BareMap>(absl::StrCat(floor, "/", kSiteMap, ".gpkg"), kObjectsLayer);
  return absl::OkStatus();
}

absl::StatusOr<Cost> EditedSite::OurEdits(int clients) {
  return CostOfLoad(*server_, OpenChannels(server_->address(), clients), EditCalls(site_, &edits_),
                    options_.pace.each);
}

absl::StatusOr<Cost> EditedSite::BareCommits() {
  LoadResult result;
  double cpu_s = 0;
  double wall_s = 0;
  const absl::Time end = absl::Now() + options_.pace.each;
  do {
    SemanticObject object = EditedObject(site_, edits_.fetch_add(1));
    object.id = bare_->next_id();
    const BareRow row = ToBareRow(object);
    const std::string request_id = absl::StrCat("bench-request-of-some-length-", object.id);
    const absl::Time start = absl::Now();
    const double cpu_start = ThreadCpuSeconds();
    bare_->Commit(&row, &row + 1, request_id);
    cpu_s += ThreadCpuSeconds() - cpu_start;
    result.latencies_s.push_back(absl::ToDoubleSeconds(absl::Now() - start));
    wall_s += result.latencies_s.back();
  } while (absl::Now() < end);
  std::sort(result.latencies_s.begin(), result.latencies_s.end());
  const auto count = static_cast<double>(result.latencies_s.size());
  return Cost{cpu_s / count, wall_s / count, result.Percentile(0.5), result.Percentile(0.99)};
}

}  // namespace hypermap::bench
