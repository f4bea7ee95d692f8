// From the messages of the rpc Watch or Replicate to events. Only for code that makes these calls.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_WATCH_DECODER_H_
#define HYPERMAP_CLIENT_LIBS_CPP_WATCH_DECODER_H_

#include <cstdint>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/watch.h"
#include "wire/catalog.h"
#include "wire/change.h"
#include "wire/time.h"

namespace hypermap::client {

// Joins the messages of a revision to one event, and checks that revisions are told in order. Used
// by one thread.
template <typename Response>
class WatchDecoder {
 public:
  // Without `with_changes`, changes are only counted.
  explicit WatchDecoder(bool with_changes) : with_changes_(with_changes) {}

  // Takes the next message, which must not be a coalesced one. Returns the event if the message is
  // the last one of its revision. INVALID_ARGUMENT if a change can't be decoded, or if the server
  // repeats a revision or goes back.
  absl::StatusOr<std::optional<WatchEvent>> Take(const Response& message) {
    HYPERMAP_RETURN_IF_ERROR(Add(message));
    if (message.more()) return std::nullopt;
    HYPERMAP_RETURN_IF_ERROR(CheckOrder());
    told_ = part_->revision;
    incarnation_ = part_->incarnation;
    return std::exchange(part_, std::nullopt);
  }

  // Forgets the messages of a revision that will not be completed, because the call has ended.
  void DropPart() { part_.reset(); }

  // The revision of the last event, and its incarnation. Absent and 0 before the first.
  std::optional<Revision> revision() const { return told_; }
  uint64_t incarnation() const { return incarnation_; }

 private:
  absl::Status Add(const Response& message) {
    if (!part_) part_.emplace();
    part_->revision = message.revision();
    part_->incarnation = message.incarnation();
    if (message.has_time()) part_->time = wire::DecodeTime(message.time());
    if (!message.author().empty()) part_->author = message.author();
    if constexpr (requires { message.map(); }) {
      if (message.has_map()) part_->map = wire::DecodeMapEntry(message.map());
    }
    part_->snapshot |= message.snapshot();
    part_->reset |= message.reset();
    part_->num_changes += message.changes_size();
    if (!with_changes_) return absl::OkStatus();
    return wire::AppendChanges(message.changes(), part_->changes);
  }

  absl::Status CheckOrder() const {
    if (!told_ || part_->snapshot) return absl::OkStatus();
    const bool in_order =
        part_->num_changes == 0 ? part_->revision >= *told_ : part_->revision > *told_;
    if (in_order) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("revision ", part_->revision, " was told after ", *told_));
  }

  const bool with_changes_;
  std::optional<WatchEvent> part_;  // the messages of a revision that have arrived
  std::optional<Revision> told_;
  uint64_t incarnation_ = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_WATCH_DECODER_H_
