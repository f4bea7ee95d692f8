#include "server/watch/watch_service.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/streamed_answer.h"
#include "server/rpc/unary_call.h"
#include "server/watch/difference_source.h"
#include "server/watch/watch_source.h"
#include "wire/catalog.h"

namespace hypermap::server {
namespace {

constexpr int kDefaultPageSize = 1000;

}  // namespace

template <typename Request>
WatchCall* WatchService::BeginWatch(grpc::CallbackServerContext* context, Rpc rpc,
                                    const grpc::ByteBuffer& bytes) {
  return BeginWatchCall<Request>(
      context, rpc, bytes, CheckQuestionSize(bytes, facilities_.limits),
      [this](const Request& request) {
        return WatchSource::Open(facilities_, shared_.tuning, &groups_, request);
      },
      &shared_);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchService::Watch(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return BeginWatch<v1::WatchRequest>(context, Rpc::kWatch, *request);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchService::Replicate(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return BeginWatch<v1::ReplicateRequest>(context, Rpc::kReplicate, *request);
}

void WatchService::EndAfter(absl::Duration grace) {
  shared_.timers.RunAfter(grace, [this] { shared_.open_watches.CancelWrites(); });
}

void WatchService::EndUnwanted() { shared_.open_watches.EndUnwanted(); }

grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchService::ListChanges(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  auto* const answer = new StreamedAnswer<v1::ListChangesRequest, v1::ListChangesResponse>(
      facilities_.for_calls(), context, Rpc::kListChanges, *request,
      &facilities_.workers->questions, &facilities_.workers->long_questions,
      [this](const v1::ListChangesRequest& asked, absl::string_view) {
        return OpenDifference(facilities_, asked);
      },
      CheckQuestionSize(*request, facilities_.limits));
  answer->BeginOnWorker();
  return answer;
}

grpc::ServerUnaryReactor* WatchService::ListRevisions(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request,
                                                      grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ListRevisionsRequest, v1::ListRevisionsResponse>(
      facilities_.for_calls(), context, Rpc::kListRevisions, {request, response});
  return AnswerOn(&facilities_.workers->questions, call, [this, call] {
    return AnswerRevisions(*call, call->request(), call->response());
  });
}

absl::StatusOr<int64_t> WatchService::AnswerRevisions(UnaryCall& call,
                                                      const v1::ListRevisionsRequest& request,
                                                      v1::ListRevisionsResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  if (request.page_size() < 0) return absl::InvalidArgumentError("page_size is negative");
  const int page_size = request.page_size() == 0
                            ? kDefaultPageSize
                            : std::min(request.page_size(), FixedLimits::kMaxPageSize);
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
  response->set_incarnation(session->incarnation());
  response->set_oldest_revision(kept.oldest);
  call.set_advice("ask for smaller pages");
  for (const storage::RevisionRecord& record : records) {
    v1::RevisionInfo* const encoded = response->add_revisions();
    wire::EncodeRevisionRecord(record, encoded);
    HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
  }
  return response->revisions_size();
}

}  // namespace hypermap::server
