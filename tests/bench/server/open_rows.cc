#include <algorithm>

#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/questions.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

constexpr int kMostStarts = 3;

// Bytes of the coordinates of all vertices, which any index has to hold.
double RawRingBytes(const GeneratedSite& site) {
  int64_t bytes = 0;
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    bytes += site.Object(i).shape.num_vertices() * static_cast<int64_t>(sizeof(Point));
  }
  return static_cast<double>(bytes);
}

struct Opened {
  double cpu_s = 0;
  double wall_s = 0;
  double resident_bytes = 0;
};

absl::StatusOr<Opened> Open(const Options& options, const std::string& folder,
                            const Calls& first_question) {
  const absl::Time start = absl::Now();
  const auto server = StartHypermap(options, folder);
  HYPERMAP_RETURN_IF_ERROR(server.status());
  const auto answer = Ask(OpenChannels((*server)->address(), 1), first_question, 1);
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  return Opened{absl::ToDoubleSeconds((*server)->CpuTime()),
                absl::ToDoubleSeconds(absl::Now() - start),
                static_cast<double>((*server)->ResidentBytes())};
}

}  // namespace

absl::Status AddOpenRows(Bench& bench, const GeneratedSite& site, const std::string& folder) {
  const Calls first_question = PointCalls(DrawQuestions(site, 1));
  std::vector<double> cpu_s;
  std::vector<double> wall_s;
  std::vector<double> resident;
  for (int i = 0; i < std::min(kMostStarts, bench.options.pace.repeats); ++i) {
    const absl::StatusOr<Opened> opened = Open(bench.options, folder, first_question);
    HYPERMAP_RETURN_IF_ERROR(opened.status());
    cpu_s.push_back(opened->cpu_s);
    wall_s.push_back(opened->wall_s);
    resident.push_back(opened->resident_bytes);
  }
  const auto objects = static_cast<double>(site.num_objects());
  Row open;
  open.name = absl::StrFormat("open %d objects to first answer", site.num_objects());
  open.ours = Median(cpu_s);
  open.unit = "s CPU";
  open.ratio = open.ours;
  open.target = AtMost(4);
  open.note = absl::StrFormat("%.2f s wall", Median(wall_s));
  bench.report.Add(std::move(open));

  const double rings = RawRingBytes(site);
  Row memory;
  memory.name = "resident memory above the raw rings";
  memory.ours = (Median(resident) - rings) / objects;
  memory.unit = "B/object";
  memory.ratio = memory.ours;
  memory.target = AtMost(400);
  memory.note = absl::StrFormat("the whole process %.0f MB, rings %.0f bytes an object",
                                Median(resident) / 1e6, rings / objects);
  bench.report.Add(std::move(memory));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
