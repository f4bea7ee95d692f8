#include "server/session/read_index.h"

#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

absl::Status Closing() { return absl::UnavailableError("the server is closing"); }

}  // namespace

absl::StatusOr<std::unique_ptr<ReadIndex>> ReadIndex::Start(storage::MapStore* store,
                                                            Executor* executor) {
  std::unique_ptr<ReadIndex> index(new ReadIndex(store));
  HYPERMAP_ASSIGN_OR_RETURN(index->loop_, executor->Start("hm-read-index", [loop = index.get()] {
    return loop->Step();
  }));
  return index;
}

ReadIndex::~ReadIndex() { Close(); }

void ReadIndex::Ask(const std::string& map, Callback done) {
  {
    const MutexLock lock(&mutex_);
    if (!closed_) {
      waiting_.push_back({map, std::move(done)});
      return loop_->Wake();
    }
  }
  std::move(done)(Closing());
}

void ReadIndex::Close() {
  std::vector<Question> waiting;
  {
    const MutexLock lock(&mutex_);
    closed_ = true;
    waiting = std::exchange(waiting_, {});
    if (loop_) loop_->Wake();
  }
  for (Question& question : waiting) std::move(question.done)(Closing());
  if (loop_) loop_->Join();
}

std::optional<absl::Duration> ReadIndex::Step() {
  std::vector<Question> questions;
  {
    const MutexLock lock(&mutex_);
    if (closed_) return std::nullopt;
    questions = std::exchange(waiting_, {});
  }
  if (!questions.empty()) Answer(std::move(questions));
  // Questions that came meanwhile have made the next step due.
  return absl::InfiniteDuration();
}

void ReadIndex::Answer(std::vector<Question> questions) {
  // The read is for all callers, also if the one who made it due has gone.
  const ScopedCancellation to_the_end(nullptr);
  std::set<std::string> names;
  for (const Question& question : questions) names.insert(question.map);
  const auto newest = store_->NewestRevisions({names.begin(), names.end()});
  for (Question& question : questions) {
    if (!newest.ok()) {
      std::move(question.done)(newest.status());
      continue;
    }
    const auto found = newest->find(question.map);
    if (found != newest->end()) {
      std::move(question.done)(found->second);
    } else {
      std::move(question.done)(
          absl::NotFoundError(absl::StrCat("there is no map \"", question.map, "\"")));
    }
  }
}

}  // namespace hypermap::server
