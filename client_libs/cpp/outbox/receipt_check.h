// Tells whether the server still has the receipt of a request that was sent long ago.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_RECEIPT_CHECK_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_RECEIPT_CHECK_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// Reads the clocks of this machine.
storage::SendTime ReadClocks();

// Judges requests by the time since they were sent. Within a boot of the machine, that is the time
// since boot, which nobody can set. Across boots only a wall clock that a time server kept right at
// both ends tells for how long the machine was off: without a battery, a clock goes on from where
// it stopped. Used by one thread.
class ReceiptCheck {
 public:
  // Time for which a request waits for a time server to set the wall clock.
  static constexpr absl::Duration kSynchronization = absl::Minutes(10);

  // `max_age`: the longest time since the sending for which the server surely has the receipt.
  explicit ReceiptCheck(absl::Duration max_age) : max_age_(max_age) {}

  // OK if the server has the receipt, provided that it ever got the request. ABORTED if the receipt
  // may be gone. UNAVAILABLE if that will be known when a time server has set the wall clock; after
  // kSynchronization of this answer it is ABORTED.
  absl::Status Check(const storage::SendTime& sent, const storage::SendTime& now);

 private:
  const absl::Duration max_age_;
  // SendTime::since_boot of the first UNAVAILABLE.
  std::optional<absl::Duration> waiting_since_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_RECEIPT_CHECK_H_
