#include "client_libs/cpp/replica/comparison.h"

#include <map>
#include <utility>

#include "absl/algorithm/container.h"
#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status/status_macros.h"
#include "map/digest/content_digest.h"

namespace hypermap::client {
namespace {

// How long the replica may take to come to the revision of the answer.
constexpr absl::Duration kPatience = absl::Seconds(10);
// Questions of a round. Another one is asked if the replica skipped the revision of the answer.
constexpr int kQuestions = 3;
// Revisions that are kept while a question is under way. They share most of their content.
constexpr size_t kMaxPassed = 1000;
// The end of the replica waits for a call.
constexpr absl::Duration kCallTimeout = absl::Seconds(5);

}  // namespace

Comparison::Comparison(Client client, const ReplicaOptions& options, std::function<void()> differs)
    : client_(std::move(client)), options_(options), differs_(std::move(differs)) {
  thread_ = std::thread([this] { Run(); });
}

void Comparison::Stop() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    is_ending_ = true;
  }
  changed_.NotifyAll();
  thread_.join();
}

void Comparison::Note(const KnownRevision& revision) {
  {
    const MutexLock lock(&mutex_);
    if (!is_asking_) passed_.clear();
    if (passed_.size() == kMaxPassed) passed_.erase(passed_.begin());
    passed_.push_back(revision);
  }
  changed_.NotifyAll();
}

Comparison::Count Comparison::count() const {
  const MutexLock lock(&mutex_);
  return count_;
}

void Comparison::Run() {
  while (AwaitRound()) {
    for (int i = 0; i < kQuestions; ++i) {
      const absl::StatusOr<bool> compared = Compare();
      if (!compared.ok() || *compared) break;  // an error is for the next round
    }
  }
}

bool Comparison::AwaitRound() {
  const Deadline round(options_.compare_every);
  const MutexLock lock(&mutex_);
  while (!is_ending_ && !round.has_passed()) changed_.WaitFor(&mutex_, round.left());
  return !is_ending_;
}

absl::StatusOr<bool> Comparison::Compare() {
  {
    const MutexLock lock(&mutex_);
    is_asking_ = true;
  }
  const absl::Cleanup asked = [this] {
    const MutexLock lock(&mutex_);
    is_asking_ = false;
    if (passed_.size() > 1) passed_ = {passed_.back()};
  };
  CallOptions call;
  call.timeout = kCallTimeout;
  call.retry_for = absl::ZeroDuration();
  HYPERMAP_ASSIGN_OR_RETURN(const DigestAnswer answer, client_.DigestMap(options_.map, call));
  const SnapshotPtr replica = Await(answer);
  if (replica == nullptr) return false;
  const std::vector<std::string> differing = Differing(*replica, answer);
  {
    const MutexLock lock(&mutex_);
    ++(differing.empty() ? count_.num_equal : count_.num_different);
    if (differing.empty()) return true;
    count_.last_difference =
        absl::StrCat("revision ", answer.digest.revision, ": ", absl::StrJoin(differing, ", "));
  }
  differs_();
  return true;
}

SnapshotPtr Comparison::Await(const DigestAnswer& answer) {
  const Deadline patience(kPatience);
  const MutexLock lock(&mutex_);
  while (!is_ending_ && !patience.has_passed()) {
    for (const KnownRevision& passed : passed_) {
      if (IsComparable(passed, answer)) return passed.snapshot;
    }
    if (!passed_.empty() && passed_.back().incarnation == answer.incarnation &&
        passed_.back().snapshot->revision > answer.digest.revision) {
      return nullptr;
    }
    changed_.WaitFor(&mutex_, patience.left());
  }
  return nullptr;
}

bool Comparison::IsMirrored(const std::string& layer) const {
  return options_.layers.empty() || absl::c_linear_search(options_.layers, layer);
}

bool Comparison::IsComparable(const KnownRevision& replica, const DigestAnswer& answer) const {
  const Snapshot& snapshot = *replica.snapshot;
  if (replica.incarnation != answer.incarnation) return false;
  if (snapshot.revision == answer.digest.revision) return true;
  // A replica of some layers is not told of each revision that changes others.
  if (options_.layers.empty()) return false;
  return absl::c_all_of(options_.layers, [&](const std::string& layer) {
    const auto there = answer.layer_versions.find(layer);
    const Revision version = there == answer.layer_versions.end() ? 0 : there->second;
    return snapshot.LayerVersionOf(layer) == version;
  });
}

std::vector<std::string> Comparison::Differing(const Snapshot& replica,
                                               const DigestAnswer& answer) const {
  ContentDigest there = answer.digest;
  std::erase_if(there.layers, [&](const auto& layer) { return !IsMirrored(layer.first); });
  const ContentDigest here = DigestOf(replica);
  // Frames have no version.
  if (here.revision != there.revision) there.frames = here.frames;
  return DifferingParts(here, there);
}

}  // namespace hypermap::client
