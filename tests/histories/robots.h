// The clients of a simulated history.
#ifndef HYPERMAP_TESTS_HISTORIES_ROBOTS_H_
#define HYPERMAP_TESTS_HISTORIES_ROBOTS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client_libs/cpp/replica/feed_cursor.h"
#include "client_libs/cpp/watch_decoder.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/edits/edit.h"
#include "tests/histories/network.h"
#include "tests/histories/plant.h"
#include "tests/histories/record.h"
#include "tests/histories/schedule.h"

namespace hypermap::histories {

inline constexpr char kThings[] = "things";
inline constexpr char kSeen[] = "seen";  // fused
inline constexpr char kFloor[] = "floor";

// Random edits, of which each puts an object of this label. They may also fail: an object that they
// name may be gone.
EditBatch RandomEdits(Schedule& schedule, const std::string& label);

// Sends edits one after the other, each until the server has answered it, with its request id.
class Editor {
 public:
  // All must outlive this.
  Editor(Schedule* schedule, const Network* network, Record* record, std::string name,
         int num_edits);
  bool done() const { return next_ >= num_edits_; }

 private:
  void Begin();
  void Send();
  void Take(const absl::StatusOr<client::EditAnswer>& answer);

  Schedule* const schedule_;
  const Network* const network_;
  Record* const record_;
  const std::string name_;
  const int num_edits_;
  int next_ = 0;
  std::string request_id_;
  EditBatch batch_;
  bool retracts_ = false;  // instead of the batch
};

// A replica that follows the map. It is restarted with a revision that it has written to its disk.
class Mirror {
 public:
  // All must outlive this.
  Mirror(Schedule* schedule, const Network* network, Record* record, Plant plant);

  // The process is killed and started again.
  void Restart();
  // The revision that it has; -1: none.
  Revision revision() const;

 private:
  using Decoder = client::WatchDecoder<v1::ReplicateResponse>;

  void Open();
  void Take(int64_t call, const std::string& bytes);
  // Returns false if the call must be ended.
  absl::Status Take(const v1::ReplicateResponse& message);
  void End(int64_t call, const absl::Status& why);

  Schedule* const schedule_;
  const Network* const network_;
  Record* const record_;
  const Plant plant_;
  std::optional<client::FeedCursor> cursor_;
  std::optional<Decoder> decoder_;
  std::optional<client::KnownRevision> written_;
  int64_t call_ = 0;  // messages of earlier calls are dropped
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_ROBOTS_H_
