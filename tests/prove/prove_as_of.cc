#include <algorithm>
#include <vector>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {
namespace {

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Returns the duration of the query in milliseconds.
absl::StatusOr<double> Time(client::Client& client, const Selection& selection,
                            std::optional<Revision> at, State& answer) {
  const absl::Time begin = absl::Now();
  absl::StatusOr<State> state = AskState(client, selection, at);
  HYPERMAP_RETURN_IF_ERROR(state.status());
  const absl::Duration took = absl::Now() - begin;
  answer = *std::move(state);
  return absl::ToDoubleMilliseconds(took);
}

}  // namespace

absl::StatusOr<Verdict> ProveAsOf(Site& site, const Sizes& sizes) {
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  {
    WriterGroup writers(site, sizes.writers, {.edits = sizes.edits}, sizes.seed);
    HYPERMAP_RETURN_IF_ERROR(writers.Wait());
  }
  Model& model = site.model();
  const int64_t unaccounted = model.Sort();
  const PastModel past(model);
  const Revision newest = model.newest();

  client::Client client = site.NewClient();
  Rng rng(sizes.seed);
  std::vector<double> then, now, ratios;
  int64_t wrong_then = 0, wrong_now = 0;
  for (int i = 0; i < sizes.queries; ++i) {
    const Selection selection{RandomArea(rng, 1.0, 12.0), {}};
    // The first revisions created the map and its layers.
    const Revision at = 3 + static_cast<Revision>(rng() % (newest - 2));
    State answer;
    // Each of the two is queried first equally often.
    absl::StatusOr<double> ms_then, ms_now;
    for (const bool ask_then : {i % 2 == 0, i % 2 != 0}) {
      absl::StatusOr<double>& ms = ask_then ? ms_then : ms_now;
      ms = Time(client, selection, ask_then ? std::optional(at) : std::nullopt, answer);
      HYPERMAP_RETURN_IF_ERROR(ms.status());
      const bool right = answer == past.In(*selection.area, ask_then ? at : newest);
      (ask_then ? wrong_then : wrong_now) += !right;
    }
    then.push_back(*ms_then);
    now.push_back(*ms_now);
    ratios.push_back(*ms_then / *ms_now);
  }
  const double ratio = Median(ratios);
  return Verdict{{"proof", "as_of"},
                 {"seed", sizes.seed},
                 {"edits", model.num_edits()},
                 {"revisions", newest},
                 {"queries", sizes.queries},
                 {"wrong", wrong_then},
                 {"wrong_at_newest", wrong_now},
                 {"unaccounted_revisions", unaccounted},
                 {"median_ms", Median(then)},
                 {"median_ms_at_newest", Median(now)},
                 {"median_cost_ratio", ratio},
                 {"holds", wrong_then == 0 && wrong_now == 0 && unaccounted == 0 &&
                               (!sizes.judge_speed || ratio <= 3.0)}};
}

}  // namespace hypermap::prove
