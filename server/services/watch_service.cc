#include "server/services/watch_service.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/services/difference_source.h"
#include "server/services/streamed_answer.h"
#include "server/services/unary_call.h"
#include "server/services/watch_messages.h"
#include "wire/status.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

constexpr int kDefaultPageSize = 1000;
constexpr int kMaxPageSize = 10'000;

class RefusedWatch final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  RefusedWatch(const grpc::CallbackServerContext& context, const absl::Status& status) {
    RequestLog(context, "Watch", "").Finished(status, 0);
    Finish(wire::EncodeStatus(status));
  }
  void OnDone() override { delete this; }
};

}  // namespace

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchService::Watch(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  absl::StatusOr<v1::WatchRequest> parsed = ParseWatchRequest(*request);
  if (!parsed.ok()) return new RefusedWatch(*context, parsed.status());
  return new WatchCall(context, *std::move(parsed), &facilities_, &groups_, &watches_, &timers_,
                       &lines_);
}

void WatchService::EndAfter(absl::Duration grace) {
  timers_.RunAfter(grace, [this] { watches_.CancelWrites(); });
}

grpc::ServerWriteReactor<v1::ListChangesResponse>* WatchService::ListChanges(
    grpc::CallbackServerContext* context, const v1::ListChangesRequest* request) {
  return new StreamedAnswer<v1::ListChangesResponse>(
      context, RequestLog(*context, "ListChanges", request->map()), facilities_.workers,
      [this, request] { return OpenDifference(facilities_, *request); });
}

grpc::ServerUnaryReactor* WatchService::ListRevisions(grpc::CallbackServerContext* context,
                                                      const v1::ListRevisionsRequest* request,
                                                      v1::ListRevisionsResponse* response) {
  auto call = std::make_shared<UnaryCall>(context, "ListRevisions", request->map());
  return AnswerOn(facilities_.workers, std::move(call),
                  [this, request, response] { return AnswerRevisions(*request, response); });
}

absl::StatusOr<int64_t> WatchService::AnswerRevisions(const v1::ListRevisionsRequest& request,
                                                      v1::ListRevisionsResponse* response) const {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities_, request.map());
  if (!session.ok()) return session.status();
  if (request.page_size() < 0) return absl::InvalidArgumentError("page_size is negative");
  const int page_size =
      request.page_size() == 0 ? kDefaultPageSize : std::min(request.page_size(), kMaxPageSize);
  const Revision newest = (*session)->snapshot()->revision;
  const Revision before =
      request.before_revision() == 0 ? newest + 1 : std::min(request.before_revision(), newest + 1);
  absl::StatusOr<HistoryPool::Lease> history = (*session)->OpenHistory();
  if (!history.ok()) return history.status();
  const absl::StatusOr<storage::KeptRevisions> kept = (*history)->Kept();
  if (!kept.ok()) return kept.status();
  const absl::StatusOr<std::vector<storage::RevisionRecord>> records =
      (*history)->Revisions(request.after_revision(), before, request.newest_first(), page_size);
  if (!records.ok()) return records.status();
  response->set_map(request.map());
  response->set_newest_revision(newest);
  response->set_oldest_revision(kept->oldest);
  for (const storage::RevisionRecord& record : *records) {
    v1::RevisionInfo* const info = response->add_revisions();
    info->set_revision(record.revision);
    wire::EncodeTime(record.time, info->mutable_time());
    info->set_author(record.author);
    info->set_num_changes(record.num_changes);
  }
  return response->revisions_size();
}

}  // namespace hypermap::server
