#include "server/watch/watch_service.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/streamed_answer.h"
#include "server/rpc/unary_call.h"
#include "server/watch/difference_source.h"
#include "wire/status.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

constexpr int kDefaultPageSize = 1000;
constexpr int kMaxPageSize = 10'000;

// Ends a call whose request can't be parsed. Owns itself until OnDone.
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
  v1::WatchRequest parsed;
  if (absl::Status status = ParseRequest(*request, &parsed); !status.ok()) {
    return new RefusedWatch(*context, status);
  }
  return new WatchCall(context, std::move(parsed), &facilities_, &groups_, &watches_, &timers_,
                       &tick_queues_);
}

void WatchService::EndAfter(absl::Duration grace) {
  timers_.RunAfter(grace, [this] { watches_.CancelWrites(); });
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchService::ListChanges(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  auto* const answer = new StreamedAnswer<v1::ListChangesRequest, v1::ListChangesResponse>(
      context, "ListChanges", *request, facilities_.workers,
      [this](const v1::ListChangesRequest& asked) { return OpenDifference(facilities_, asked); });
  answer->BeginOnWorker();
  return answer;
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
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map()));
  if (request.page_size() < 0) return absl::InvalidArgumentError("page_size is negative");
  const int page_size =
      request.page_size() == 0 ? kDefaultPageSize : std::min(request.page_size(), kMaxPageSize);
  const Revision newest = session->snapshot()->revision;
  const Revision before =
      request.before_revision() == 0 ? newest + 1 : std::min(request.before_revision(), newest + 1);
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session->OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(const storage::KeptRevisions kept, history->Kept());
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::vector<storage::RevisionRecord> records,
      history->Revisions(request.after_revision(), before, request.newest_first(), page_size));
  response->set_map(request.map());
  response->set_newest_revision(newest);
  response->set_oldest_revision(kept.oldest);
  for (const storage::RevisionRecord& record : records) {
    v1::RevisionInfo* const info = response->add_revisions();
    info->set_revision(record.revision);
    wire::EncodeTime(record.time, info->mutable_time());
    info->set_author(record.author);
    info->set_num_changes(record.num_changes);
  }
  return response->revisions_size();
}

}  // namespace hypermap::server
