#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/geopackage_store.h"
#include "tests/bench/bare_map.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

absl::StatusOr<Cost> OurImport(const Options& options, const GeneratedSite& site) {
  const ScratchFolder scratch(options.scratch);
  auto store = storage::OpenGeoPackageStore(scratch.path());
  HYPERMAP_RETURN_IF_ERROR(store.status());
  auto map = CreateObjectsMap(store->get(), kSiteMap);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  const storage::Commit commit = CommitOfObjects(site, 0, site.num_objects(), 2);
  const absl::Time start = absl::Now();
  const double cpu_start = ThreadCpuSeconds();
  if (absl::Status status = (*map)->Write({&commit, 1}); !status.ok()) return status;
  const auto count = static_cast<double>(site.num_objects());
  return Cost{(ThreadCpuSeconds() - cpu_start) / count,
              absl::ToDoubleSeconds(absl::Now() - start) / count, 0, 0};
}

absl::StatusOr<Cost> BareImport(const Options& options, const GeneratedSite& site) {
  const ScratchFolder scratch(options.scratch);
  {
    auto store = storage::OpenGeoPackageStore(scratch.path());
    HYPERMAP_RETURN_IF_ERROR(store.status());
    auto map = CreateObjectsMap(store->get(), kSiteMap);
    HYPERMAP_RETURN_IF_ERROR(map.status());
  }
  BareMap bare(absl::StrCat(scratch.path(), "/", kSiteMap, ".gpkg"), kObjectsLayer);
  std::vector<BareRow> rows;
  for (int64_t i = 0; i < site.num_objects(); ++i) rows.push_back(ToBareRow(site.Object(i)));
  const absl::Time start = absl::Now();
  const double cpu_start = ThreadCpuSeconds();
  bare.Commit(rows.data(), rows.data() + rows.size());
  const auto count = static_cast<double>(site.num_objects());
  return Cost{(ThreadCpuSeconds() - cpu_start) / count,
              absl::ToDoubleSeconds(absl::Now() - start) / count, 0, 0};
}

}  // namespace

absl::Status AddImportRow(Bench& bench) {
  const GeneratedSite site(bench.options.import_objects);
  Pace pace = bench.options.pace;
  pace.repeats = std::min(pace.repeats, 3);
  const absl::StatusOr<Contest> contest = Alternate(
      pace, [&] { return OurImport(bench.options, site); },
      [&] { return BareImport(bench.options, site); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  Row row;
  row.name = absl::StrFormat("bulk import of %d / bare sorted insert", site.num_objects());
  row.ours = contest->ours.cpu_s * 1e6;
  row.floor = contest->floor.cpu_s * 1e6;
  row.unit = "us CPU/object";
  row.ratio = contest->cpu_ratio();
  row.target = AtMost(1.3);
  row.note = absl::StrFormat("by the clock %.1f and %.1f us", contest->ours.wall_s * 1e6,
                             contest->floor.wall_s * 1e6);
  bench.report.Add(std::move(row));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
