// The state of a feed: which revision a replica has, and from where it goes on.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_CURSOR_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_CURSOR_H_

#include <optional>

#include "absl/status/status.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/replica/replica.h"
#include "client_libs/cpp/watch.h"

namespace hypermap::client {

// Decides what each call of Replicate asks for, and applies its events to the copy of the map.
// Makes no calls and has no clock, so that a thread and a simulation can drive it alike:
//
//   FeedCursor cursor(options, known);
//   while (true) {
//     ... = client.Replicate(options.map, cursor.BeginCall());
//     for each event: if (!cursor.Take(event).ok()) end the call;
//     cursor.EndCall(reason);
//   }
//
// Used by one thread at a time.
class FeedCursor {
 public:
  // `known`: the revision to resume from, if any.
  FeedCursor(const ReplicaOptions& options, std::optional<KnownRevision> known);

  // Makes the next call begin with a snapshot.
  void StartAnew() { starts_anew_ = true; }

  // Begins a call; returns its options.
  ReplicateOptions BeginCall();

  // What an event was.
  struct Step {
    bool resumed = false;     // the first event of a call that goes on from the known revision
    bool taken_anew = false;  // a snapshot in place of a known revision
    bool is_first = false;    // of its call
    bool caught_up = false;   // the revision that was the newest at the opening has arrived
  };
  // Takes an event of the call. INTERNAL if it does not fit; the call must be ended then.
  absl::StatusOr<Step> Take(const WatchEvent& event);

  // Ends the call. The next one begins with a snapshot if the server can't go on from the known
  // revision: it no longer keeps it or does not have it yet, the map is another incarnation or has
  // another revision of that number, or the events did not fit.
  void EndCall(const absl::Status& why);

  // The newest revision that was taken.
  const std::optional<KnownRevision>& known() const { return known_; }

 private:
  const ReplicaOptions options_;
  std::optional<KnownRevision> known_;
  bool starts_anew_ = false;     // the next call does not go on from known_
  bool is_first_ = true;         // the call has had no event yet
  Revision newest_at_open_ = 0;  // the map's newest revision when the call was opened
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_CURSOR_H_
