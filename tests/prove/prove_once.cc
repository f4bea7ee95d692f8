#include <set>

#include "base/status/status_macros.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {

absl::StatusOr<Verdict> ProveOnce(Site& site, const Sizes& /*sizes*/) {
  constexpr int kTimes = 5;
  constexpr int kBeforeRestart = 2;
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  client::Client client = site.NewClient();
  const absl::StatusOr<client::MapEntry> before = client.GetMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(before.status());

  SemanticObject chair;
  chair.label = "chair";
  chair.shape = Polygon::FromBox({{1.0, 1.0}, {2.0, 2.0}});
  client::CallOptions options;
  options.request_id = client::NewRequestId();
  std::set<Revision> revisions;
  std::set<std::vector<ObjectId>> ids;
  for (int i = 0; i < kTimes; ++i) {
    if (i == kBeforeRestart) {
      site.server().Kill();
      HYPERMAP_RETURN_IF_ERROR(site.server().Start());
    }
    const auto answer = client.ApplyEdits(kMap, {{PutObject{kThings, chair, ""}}, {}, {}}, options);
    HYPERMAP_RETURN_IF_ERROR(answer.status());
    revisions.insert(answer->revision);
    ids.insert(answer->object_ids);
  }
  const absl::StatusOr<client::MapEntry> after = client.GetMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(after.status());
  const absl::StatusOr<State> state = AskState(client, {});
  HYPERMAP_RETURN_IF_ERROR(state.status());
  const bool holds = revisions.size() == 1 && ids.size() == 1 && state->things.size() == 1 &&
                     after->revision == before->revision + 1 &&
                     *revisions.begin() == after->revision;
  return Verdict{{"proof", "once"},
                 {"sent", kTimes},
                 {"restarts", 1},
                 {"different_revisions_answered", revisions.size()},
                 {"different_ids_answered", ids.size()},
                 {"revisions_made", after->revision - before->revision},
                 {"objects_made", state->things.size()},
                 {"holds", holds}};
}

}  // namespace hypermap::prove
