#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/outbox/outbox.h"
#include "client_libs/cpp/replica/replica.h"
#include "tests/prove/outbox_holder.h"
#include "tests/prove/proofs.h"
#include "tests/prove/questions.h"
#include "tests/prove/site.h"

namespace hypermap::prove {
namespace {

absl::Status MakeLayers(client::Client client) {
  for (const char* name : {kQueued, kSeen}) {
    LayerSpec spec;
    spec.name = name;
    if (auto made = client.CreateLayer(kMap, spec); !made.ok()) return made.status();
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<client::Replica>> OpenReplica(Site& site) {
  return client::Replica::Open(
      site.NewClient(),
      {.map = kMap, .folder = site.folder() + "/robot", .compare_every = absl::Seconds(1)});
}

// Queries, and the server's answers before it was stopped.
struct Examination {
  std::vector<Question> questions;
  std::vector<Answer> answers;
  State state;  // of the model, at the revision of the answers
};

absl::StatusOr<Examination> Prepare(Site& site, const Sizes& sizes) {
  Examination examination;
  Rng rng(sizes.seed);
  client::Client client = site.NewClient();
  for (int i = 0; i < sizes.queries; ++i) {
    examination.questions.push_back(RandomQuestion(i, rng));
    absl::StatusOr<Answer> answer = Ask(client, examination.questions.back());
    HYPERMAP_RETURN_IF_ERROR(answer.status());
    examination.answers.push_back(*std::move(answer));
  }
  site.model().Sort();
  examination.state = site.model().At(site.model().newest(), {});
  return examination;
}

// Verdict on a replica's answers.
struct Marks {
  int64_t asked = 0;
  int64_t unlike_server = 0;
  int64_t unlike_model = 0;

  bool all_right(int64_t wanted) const {
    return asked == wanted && unlike_server == 0 && unlike_model == 0;
  }
};

absl::Status Examine(const client::Replica& replica, const Question& question,
                     const Answer& expected, const State& state, Marks& marks) {
  const absl::StatusOr<Answer> answer = Ask(replica, question);
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  ++marks.asked;
  marks.unlike_server += answer->revision != expected.revision || answer->text != expected.text;
  marks.unlike_model += !IsRight(*answer, question, state);
  return absl::OkStatus();
}

// Sends all queries to the replica, spread over the time without a server. Half way, the replica is
// closed and opened again from its file.
absl::StatusOr<Marks> AnswerOffline(Site& site, const Examination& examination, const Sizes& sizes,
                                    std::unique_ptr<client::Replica>& replica) {
  Marks marks;
  const absl::Time begin = absl::Now();
  const absl::Duration outage = absl::Seconds(sizes.outage);
  const size_t n = examination.questions.size();
  for (size_t i = 0; i < n; ++i) {
    if (i == n / 2) {
      replica.reset();
      absl::StatusOr<std::unique_ptr<client::Replica>> reopened = OpenReplica(site);
      HYPERMAP_RETURN_IF_ERROR(reopened.status());
      replica = *std::move(reopened);
    }
    absl::SleepFor(begin + outage * static_cast<double>(i) / static_cast<double>(n) - absl::Now());
    HYPERMAP_RETURN_IF_ERROR(Examine(*replica, examination.questions[i], examination.answers[i],
                                     examination.state, marks));
  }
  absl::SleepFor(begin + outage - absl::Now());
  return marks;
}

// Fate of the queued edits and observations.
struct Delivered {
  int64_t put_lost = 0;  // by killing the process that put them
  int kills = 0;
  std::map<client::Ticket, Told> told;
  int64_t told_otherwise = 0;  // reported differently the second time
};

// Fills the outbox while there is no server. The process that does so is killed half way.
absl::Status FillOutbox(Site& site, const Sizes& sizes, const std::string& file, absl::Time begin,
                        Delivered& delivered) {
  int put = 0;
  {
    absl::StatusOr<OutboxHolder> holder =
        OutboxHolder::Start(file, site.server().address(), 0, sizes.queued, begin);
    HYPERMAP_RETURN_IF_ERROR(holder.status());
    while (holder->num_put() < sizes.queued / 2 && holder->Read()) {
    }
    holder->Kill();
    ++delivered.kills;
    put = holder->num_put();
  }
  const auto outbox = client::Outbox::Open(site.NewClient(), file);
  HYPERMAP_RETURN_IF_ERROR(outbox.status());
  const absl::StatusOr<client::OutboxState> state = (*outbox)->state();
  HYPERMAP_RETURN_IF_ERROR(state.status());
  // The last entry may be in the file without having been reported.
  delivered.put_lost = std::max<int64_t>(0, put - state->queued);
  for (int i = static_cast<int>(state->queued); i < sizes.queued; ++i) {
    if (auto ticket = PutNth(**outbox, i, begin); !ticket.ok()) return ticket.status();
  }
  return absl::OkStatus();
}

// Delivers the entries of the outbox. The process that does so is killed after a third of them.
absl::Status EmptyOutbox(Site& site, const Sizes& sizes, const std::string& file,
                         Delivered& delivered) {
  {
    absl::StatusOr<OutboxHolder> holder =
        OutboxHolder::Start(file, site.server().address(), 0, 0, absl::Now());
    HYPERMAP_RETURN_IF_ERROR(holder.status());
    while (holder->told().size() < static_cast<size_t>(sizes.queued / 3) && holder->Read()) {
    }
    holder->Kill();
    ++delivered.kills;
    delivered.told = holder->told();
  }
  Mutex mutex;
  client::OutboxOptions options;
  options.delivered = [&](const client::Delivery& delivery) {
    const MutexLock lock(&mutex);
    const Told told = ToldOf(delivery);
    const auto [it, is_new] = delivered.told.emplace(delivery.ticket, told);
    delivered.told_otherwise += !is_new && it->second.number != told.number;
  };
  const auto outbox = client::Outbox::Open(site.NewClient(), file, options);
  HYPERMAP_RETURN_IF_ERROR(outbox.status());
  HYPERMAP_RETURN_IF_ERROR((*outbox)->AwaitEmpty(kPatience));
  const absl::StatusOr<std::vector<client::RefusedEntry>> refused = (*outbox)->Refused();
  HYPERMAP_RETURN_IF_ERROR(refused.status());
  return refused->empty() ? absl::OkStatus() : refused->front().why;
}

// In a stream, revisions must increase with the tickets; those of observations may be equal.
int64_t CountReorders(const std::map<client::Ticket, Told>& told) {
  int64_t reorders = 0;
  Revision last_edit = 0, last_observation = 0;
  for (const auto& [ticket, one] : told) {
    if (!one.is_edit && one.revision == 0) continue;
    Revision& last = one.is_edit ? last_edit : last_observation;
    reorders += one.is_edit ? one.revision <= last : one.revision < last;
    last = one.revision;
  }
  return reorders;
}

// The labels of the queued edits, sorted by the ids of their objects.
absl::StatusOr<std::vector<std::string>> QueuedLabels(client::Client& client) {
  client::AnswerReader reader =
      client.QueryArea(kMap, Polygon::FromBox({{0.0, 0.0}, {3.0, 3.0}}), Scope{{kQueued}, ""});
  std::vector<std::string> labels;
  while (const std::optional<client::LayerPart> part = reader.Next()) {
    for (const SemanticObject& object : part->objects) labels.push_back(object.label);
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return labels;
}

// Counts the observations of the robot that are wrong on the server, by the layer's log and by the
// one chair that all of them saw.
absl::StatusOr<int64_t> CountWrongObservations(client::Client& client, const Sizes& sizes,
                                               absl::Time begin) {
  const int64_t wanted = sizes.queued - NumEdits(sizes.queued);
  int64_t known = 0;
  {
    const auto stream = client.Observe(kMap, kSeen, {.robot = kRobot});
    HYPERMAP_RETURN_IF_ERROR(stream.status());
    for (const client::SequenceRange& range : (*stream)->opened().known) {
      known += range.last - range.first + 1;
    }
  }
  client::AnswerReader reader = client.QueryValue(kMap, "chair", std::nullopt, Scope{{kSeen}, ""});
  const std::optional<client::LayerPart> part = reader.Next();
  if (!part || part->objects.size() != 1) return absl::InternalError("there is not one chair");
  const auto history = client.ExplainObject(kMap, kSeen, part->objects.front().id);
  HYPERMAP_RETURN_IF_ERROR(history.status());
  int64_t wrong =
      std::abs(known - wanted) + std::abs(static_cast<int64_t>(history->events.size()) - wanted);
  int i = 0;
  for (int64_t sequence = 0; sequence < static_cast<int64_t>(history->events.size()); ++sequence) {
    while (IsEdit(i)) ++i;
    const client::ObjectEvent& event = history->events[sequence];
    wrong += event.at.sequence != sequence || event.at.stamp != begin + absl::Milliseconds(i);
    ++i;
  }
  return wrong;
}

// The result of the queued entries on the server.
struct Arrived {
  bool edits_in_order = false;  // and each once
  int64_t wrong_observations = 0;
  int64_t untold = 0;
  int64_t reorders = 0;

  bool all_right() const {
    return edits_in_order && wrong_observations == 0 && untold == 0 && reorders == 0;
  }
};

absl::StatusOr<Arrived> CheckArrived(client::Client& client, const Sizes& sizes, absl::Time begin,
                                     const Delivered& delivered) {
  const absl::StatusOr<std::vector<std::string>> labels = QueuedLabels(client);
  HYPERMAP_RETURN_IF_ERROR(labels.status());
  std::vector<std::string> expected_labels;
  for (int i = 0; i < sizes.queued; ++i) {
    if (IsEdit(i)) expected_labels.push_back(LabelOfEdit(i));
  }
  const absl::StatusOr<int64_t> wrong = CountWrongObservations(client, sizes, begin);
  HYPERMAP_RETURN_IF_ERROR(wrong.status());
  return Arrived{*labels == expected_labels, *wrong,
                 sizes.queued - static_cast<int64_t>(delivered.told.size()),
                 CountReorders(delivered.told)};
}

// Comparison of the complete contents of the replica and its server.
struct Comparison {
  Revision revision = 0;
  Marks marks;
  bool same = false;  // all layers and their contents
};

absl::StatusOr<Comparison> Compare(Site& site, const Examination& examination,
                                   const client::Replica& replica) {
  client::Client client = site.NewClient();
  const absl::StatusOr<client::MapEntry> map = client.GetMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  absl::Status status = replica.AwaitRevision(map->revision, kPatience);
  HYPERMAP_RETURN_IF_ERROR(status);
  Comparison comparison;
  comparison.revision = map->revision;
  site.model().Sort();
  const State state = site.model().At(site.model().newest(), {});
  for (const Question& question : examination.questions) {
    const absl::StatusOr<Answer> answer = Ask(client, question);
    HYPERMAP_RETURN_IF_ERROR(answer.status());
    status = Examine(replica, question, *answer, state, comparison.marks);
    HYPERMAP_RETURN_IF_ERROR(status);
  }
  const absl::StatusOr<std::string> there = TellAll(client);
  HYPERMAP_RETURN_IF_ERROR(there.status());
  const absl::StatusOr<std::string> here = TellAll(replica);
  HYPERMAP_RETURN_IF_ERROR(here.status());
  comparison.same = *here == *there;
  return comparison;
}

// Fills the map while a replica mirrors it.
absl::StatusOr<std::unique_ptr<client::Replica>> Mirror(Site& site, const Sizes& sizes) {
  absl::Status status = site.Start();
  if (status.ok()) status = MakeLayers(site.NewClient());
  HYPERMAP_RETURN_IF_ERROR(status);
  absl::StatusOr<std::unique_ptr<client::Replica>> replica = OpenReplica(site);
  if (!replica.ok()) return replica;
  WriterGroup writers(site, sizes.writers, {.edits = sizes.edits}, sizes.seed);
  status = writers.Wait();
  if (status.ok()) status = (*replica)->AwaitRevision(site.model().newest(), kPatience);
  HYPERMAP_RETURN_IF_ERROR(status);
  return replica;
}

// Delivers the queued entries while other clients also edit the map.
absl::Status ComeBack(Site& site, const Sizes& sizes, const std::string& file,
                      Delivered& delivered) {
  HYPERMAP_RETURN_IF_ERROR(site.server().Start());
  WriterGroup others(site, sizes.writers, {.edits = sizes.edits / 10}, sizes.seed + 1);
  absl::Status status = EmptyOutbox(site, sizes, file, delivered);
  status.Update(others.Wait());
  return status;
}

// The state once the replica has compared itself with the server, or after a minute.
client::ReplicaState AfterComparison(const client::Replica& replica) {
  const absl::Time deadline = absl::Now() + absl::Minutes(1);
  client::ReplicaState state = replica.state();
  while (state.num_equal + state.num_different == 0 && absl::Now() < deadline) {
    absl::SleepFor(absl::Milliseconds(10));
    state = replica.state();
  }
  return state;
}

}  // namespace

absl::StatusOr<Verdict> ProveReplica(Site& site, const Sizes& sizes) {
  absl::StatusOr<std::unique_ptr<client::Replica>> replica = Mirror(site, sizes);
  HYPERMAP_RETURN_IF_ERROR(replica.status());
  const absl::StatusOr<Examination> examination = Prepare(site, sizes);
  HYPERMAP_RETURN_IF_ERROR(examination.status());

  site.server().Kill();
  const std::string file = site.folder() + "/outbox.db";
  // In whole milliseconds, in which it is passed to the process.
  const absl::Time begin = absl::FromUnixMillis(absl::ToUnixMillis(absl::Now()));
  Delivered delivered;
  absl::Status status = FillOutbox(site, sizes, file, begin, delivered);
  HYPERMAP_RETURN_IF_ERROR(status);
  const absl::StatusOr<Marks> offline = AnswerOffline(site, *examination, sizes, *replica);
  HYPERMAP_RETURN_IF_ERROR(offline.status());
  const client::ReplicaState stale = (*replica)->state();

  status = ComeBack(site, sizes, file, delivered);
  HYPERMAP_RETURN_IF_ERROR(status);
  const absl::StatusOr<Comparison> after = Compare(site, *examination, **replica);
  HYPERMAP_RETURN_IF_ERROR(after.status());
  const client::ReplicaState digests = AfterComparison(**replica);
  client::Client client = site.NewClient();
  const absl::StatusOr<Arrived> arrived = CheckArrived(client, sizes, begin, delivered);
  HYPERMAP_RETURN_IF_ERROR(arrived.status());

  const bool holds = offline->all_right(sizes.queries) && !stale.connected &&
                     after->marks.all_right(sizes.queries) && after->same && arrived->all_right() &&
                     delivered.put_lost == 0 && delivered.told_otherwise == 0 &&
                     digests.num_equal > 0 && digests.num_different == 0;
  return Verdict{{"proof", "replica"},
                 {"seed", sizes.seed},
                 {"edits", site.model().num_edits()},
                 {"server_away_s", sizes.outage},
                 {"revision_offline", stale.revision},
                 {"answered_offline", offline->asked},
                 {"unlike_server", offline->unlike_server},
                 {"unlike_model", offline->unlike_model},
                 {"reopened_offline", 1},
                 {"revision_after", after->revision},
                 {"answered_after", after->marks.asked},
                 {"unlike_server_after", after->marks.unlike_server},
                 {"unlike_model_after", after->marks.unlike_model},
                 {"replica_equals_server", after->same},
                 {"digests_equal", digests.num_equal},
                 {"digests_different", digests.num_different},
                 {"resumed", digests.num_resumed},
                 {"taken_anew", digests.num_taken_anew},
                 {"queued_edits", NumEdits(sizes.queued)},
                 {"queued_observations", sizes.queued - NumEdits(sizes.queued)},
                 {"outbox_kills", delivered.kills},
                 {"lost_from_queue", delivered.put_lost},
                 {"edits_arrived_once_in_order", arrived->edits_in_order},
                 {"wrong_observations", arrived->wrong_observations},
                 {"untold_deliveries", arrived->untold},
                 {"deliveries_told_otherwise", delivered.told_otherwise},
                 {"reorders", arrived->reorders},
                 {"holds", holds}};
}

}  // namespace hypermap::prove
