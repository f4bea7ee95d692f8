#include "tests/robustness/history.h"

#include <memory>
#include <stdexcept>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "map/edits/apply.h"

namespace hypermap::robustness {
namespace {

std::string RequestOf(Revision revision) { return absl::StrCat("request ", revision); }

}  // namespace

History::History(testing::Rng& rng, const std::string& map, int num_objects, int num_commits) {
  auto empty = std::make_shared<Snapshot>();
  empty->map_name = map;
  snapshots_.push_back(std::move(empty));
  if (num_commits > 0) Add(testing::RandomSite(rng, num_objects));
  while (newest() < num_commits) Add(testing::RandomEdits(rng, *snapshots_.back()));
}

void History::Add(const EditBatch& batch) {
  absl::StatusOr<AppliedBatch> applied = Apply(*snapshots_.back(), batch);
  if (!applied.ok()) throw std::logic_error(applied.status().ToString());
  auto next = std::make_shared<Snapshot>(*applied->snapshot);
  next->revision = newest() + 1;
  storage::Commit commit;
  commit.applied = *std::move(applied);
  commit.applied.snapshot = next;
  commit.author = "editor";
  commit.time = absl::FromUnixSeconds(1'700'000'000 + next->revision);
  commit.request_id = RequestOf(next->revision);
  commits_.push_back(std::move(commit));
  snapshots_.push_back(std::move(next));
}

std::vector<storage::Commit> History::Commits(Revision from, Revision to) const {
  return {commits_.begin() + from, commits_.begin() + to};
}

std::vector<std::string> History::requests() const {
  std::vector<std::string> requests;
  for (Revision revision = 1; revision <= newest(); ++revision) {
    requests.push_back(RequestOf(revision));
  }
  return requests;
}

storage::MapHeader HeaderOf(const std::string& map) {
  return {map, "map", absl::FromUnixSeconds(1'700'000'000), "create " + map};
}

}  // namespace hypermap::robustness
