#include "tests/histories/server.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/time/server_clock.h"

namespace hypermap::histories {

// The server's end of a call of Replicate.
struct Server::Stream {
  Stream(Schedule* schedule, const Network* network) : line(schedule, network) {}

  std::unique_ptr<server::WatchSource> source;
  OrderedLine line;
  ReplicaCall call;
  server::ChangeFeed::WaitId wait = 0;
  int64_t plan = 0;  // the newest planned run counts
};

absl::StatusOr<std::unique_ptr<Server>> Server::Start(Schedule* schedule, ServerDisk* disk,
                                                      Record* record, const Network* network,
                                                      const Options& options) {
  std::unique_ptr<Server> server(new Server(schedule, disk, record, network, options));
  server::SessionOptions session;
  session.limits = options.limits;
  session.feed = options.feed;
  session.fusion = options.fusion;
  session.executor = schedule;
  session.clock = std::make_shared<ServerClock>(schedule);
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::MapStore> store, disk->Open());
  HYPERMAP_ASSIGN_OR_RETURN(server->site_, server::Site::Open(std::move(store), session));
  HYPERMAP_ASSIGN_OR_RETURN(server->session_, server->site_->Find(kMap));
  server->facilities_.site = server->site_.get();
  server->facilities_.limits = options.limits;
  return server;
}

Server::Server(Schedule* schedule, ServerDisk* disk, Record* record, const Network* network,
               const Options& options)
    : schedule_(schedule),
      disk_(disk),
      record_(record),
      network_(network),
      options_(options),
      groups_(options.limits, options.tuning) {}

Server::~Server() {
  while (!streams_.empty()) {
    const std::shared_ptr<Stream> stream = streams_.front();
    End(stream, absl::UnavailableError("the server stops"));
  }
  if (site_) site_->Close();
}

Server::EditDone Server::AnswerOf(EditDone done, const std::string& request_id) const {
  // Of a request that waits twice, the copy that is judged first may be refused, and the other not.
  const bool was_done = record_->has_request(request_id);
  return UnlessKilled<client::EditAnswer>([this, was_done, request_id, done = std::move(done)](
                                              absl::StatusOr<client::EditAnswer> answer) {
    const absl::Status& status = answer.status();
    const bool is_final = !absl::IsUnavailable(status) && !absl::IsResourceExhausted(status);
    if (was_done && !answer.ok() && is_final) {
      record_->Violate(absl::StrCat("exactly once: request ", request_id,
                                    " was refused after it was carried out: ", status.ToString()));
    }
    done(std::move(answer));
  });
}

void Server::ApplyEdits(EditBatch batch, const std::string& request_id, EditDone done) {
  session_->Submit({std::move(batch), "robot", request_id, "digest of " + request_id},
                   [done = AnswerOf(std::move(done), request_id)](
                       const absl::StatusOr<storage::Receipt>& receipt) {
                     if (!receipt.ok()) return done(receipt.status());
                     done(client::EditAnswer{kMap, receipt->revision, receipt->object_ids});
                   });
}

void Server::Retract(server::RetractObservations command, const std::string& request_id,
                     EditDone done) {
  session_->Run({std::move(command), "robot", request_id, "digest of " + request_id},
                [done = AnswerOf(std::move(done), request_id)](
                    const absl::StatusOr<storage::Receipt>& receipt) {
                  if (!receipt.ok()) return done(receipt.status());
                  done(client::EditAnswer{kMap, receipt->revision, {}});
                });
}

void Server::OpenObservations(const std::string& layer, const std::string& robot,
                              Network::Done<OpenedLayer> done) {
  done = UnlessKilled<OpenedLayer>(std::move(done));
  session_->Run({server::StartFusion{layer, {}}, "robot", ""},
                [this, layer, robot, done](const absl::StatusOr<storage::Receipt>& receipt) {
                  if (!receipt.ok()) return done(receipt.status());
                  OpenedLayer opened;
                  // The server reads them from the log, too, with a task of the writer.
                  opened.known = *record_->Sequences(layer, robot);
                  done(std::move(opened));
                });
}

void Server::Observe(const std::string& layer, std::vector<Observation> observations,
                     Network::Done<Verdicts> done) {
  session_->Observe({layer, std::move(observations), "robot"},
                    [done = UnlessKilled<Verdicts>(std::move(done))](
                        absl::StatusOr<Verdicts> verdicts) { done(std::move(verdicts)); });
}

void Server::Replicate(const v1::ReplicateRequest& request, ReplicaCall call) {
  auto stream = std::make_shared<Stream>(schedule_, network_);
  stream->call = std::move(call);
  streams_.push_back(stream);
  absl::StatusOr<std::unique_ptr<server::WatchSource>> source =
      server::WatchSource::Open(facilities_, options_.tuning, &groups_, request);
  if (!source.ok()) return End(stream, source.status());
  stream->source = *std::move(source);
  RunAfter(stream, absl::ZeroDuration());
}

void Server::RunAfter(const std::shared_ptr<Stream>& stream, absl::Duration delay) {
  schedule_->After(delay, [this, weak = std::weak_ptr<Stream>(stream), plan = ++stream->plan] {
    // The streams of a process end with it.
    const std::shared_ptr<Stream> stream = weak.lock();
    if (stream && stream->source && stream->plan == plan) Run(stream);
  });
}

void Server::Run(const std::shared_ptr<Stream>& stream) {
  using Step = server::WatchSource::Step;
  server::WatchSource& source = *stream->source;
  source.feed().Remove(std::exchange(stream->wait, 0));
  if (network_->Cuts()) return End(stream, absl::UnavailableError("connection cut"));
  grpc::Slice slice;
  absl::StatusOr<Step> step = Step::kMessage;
  const bool shared = schedule_->Chance(0.5) && source.TakeShared(schedule_->Now(), &slice);
  if (!shared) step = source.Next(schedule_->Now(), &slice);
  if (!step.ok()) return End(stream, step.status());
  if (*step == Step::kMessage) {
    stream->line.Send([call = stream->call, bytes = std::string(slice.begin(), slice.end())] {
      call.message(bytes);
    });
  }
  if (*step != Step::kNothingNew) {
    const bool waits_for_tick = *step == Step::kMessage && source.gathers();
    return RunAfter(stream, waits_for_tick ? options_.tuning.calm_tick : absl::ZeroDuration());
  }
  RunAfter(stream, source.idle_for(schedule_->Now()));
  stream->wait = source.feed().Await(source.taken(), [this, weak = std::weak_ptr<Stream>(stream)] {
    if (const auto stream = weak.lock()) RunAfter(stream, absl::ZeroDuration());
  });
}

void Server::End(const std::shared_ptr<Stream>& stream, const absl::Status& status) {
  if (stream->source) stream->source->feed().Remove(std::exchange(stream->wait, 0));
  stream->source.reset();
  stream->line.Send([call = stream->call, status] { call.end(status); });
  streams_.remove(stream);
}

}  // namespace hypermap::histories
