// A process with an outbox, which the proof kills.
#ifndef HYPERMAP_TESTS_PROVE_OUTBOX_HOLDER_H_
#define HYPERMAP_TESTS_PROVE_OUTBOX_HOLDER_H_

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cpp/outbox/outbox.h"

namespace hypermap::prove {

inline constexpr char kRobot[] = "cart";
inline constexpr char kQueued[] = "queued";  // the layer of the edits
inline constexpr char kSeen[] = "seen";      // the layer of the observations

// Every sixth of the numbered entries is an edit; the others are observations.
inline bool IsEdit(int i) { return i % 6 == 5; }
inline int NumEdits(int n) { return n / 6; }
std::string LabelOfEdit(int i);

// Puts entry `i`. Observations have stamps a millisecond apart from `begin` on, and see the same
// chair.
absl::StatusOr<client::Ticket> PutNth(client::Outbox& outbox, int i, absl::Time begin);

// A reported delivery.
struct Told {
  bool is_edit = false;
  int64_t number = 0;     // id of the object, or sequence of the observation
  Revision revision = 0;  // that resulted; 0 for a duplicate observation

  friend bool operator==(const Told&, const Told&) = default;
};
Told ToldOf(const client::Delivery& delivery);

// The process. Used by one thread.
class OutboxHolder {
 public:
  // Starts a process that opens the outbox `file` of a client of `server`, puts the entries first
  // <= i < end, and delivers.
  static absl::StatusOr<OutboxHolder> Start(const std::string& file, const std::string& server,
                                            int first, int end, absl::Time begin);
  OutboxHolder(OutboxHolder&& other) noexcept;
  OutboxHolder& operator=(OutboxHolder&&) = delete;
  ~OutboxHolder();

  // Reads the next line of the process's output. Returns false when the process has ended.
  bool Read();
  // Sends SIGKILL, then reads the rest of the output.
  void Kill();

  int num_put() const { return num_put_; }
  const std::map<client::Ticket, Told>& told() const { return told_; }

 private:
  OutboxHolder(pid_t pid, int output) : pid_(pid), output_(output) {}

  pid_t pid_;
  int output_;
  std::string line_;
  int num_put_ = 0;
  std::map<client::Ticket, Told> told_;
};

// Runs the holder if this program was started as one, and returns the exit code. Otherwise returns
// nullopt.
std::optional<int> HoldOutbox(int argc, char** argv);

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_OUTBOX_HOLDER_H_
