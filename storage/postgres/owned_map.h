// A map in PostgreSQL that this process owns: all its writes pass here.
#ifndef HYPERMAP_STORAGE_POSTGRES_OWNED_MAP_H_
#define HYPERMAP_STORAGE_POSTGRES_OWNED_MAP_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Every transaction that writes the map first puts a new random number into the row of the map, if
// the row still has the epoch under which the map was opened and the number of the transaction
// before; else it fails as a whole. So an owner that was replaced can write nothing. And if the
// connection breaks, so that it is not known whether a transaction was committed, the number tells
// that afterwards; a new number then keeps the old session from committing later.
//
// One thread at a time.
class OwnedMap {
 public:
  struct Row {
    int64_t map = 0;
    int64_t epoch = 0;
    int64_t last_write = 0;
  };
  // For this long a write whose outcome is unknown waits for the database to tell it.
  static constexpr absl::Duration kTimeToSettle = absl::Seconds(30);

  OwnedMap(ConnectOptions options, const Row& row);
  // A map that another server owns. Nothing can be written: FAILED_PRECONDITION.
  static std::unique_ptr<OwnedMap> OfAnother(ConnectOptions options, int64_t map);

  // A map as it is at the first use of the connection: all reads are in one transaction. Nothing
  // can be written.
  static std::unique_ptr<OwnedMap> AtOneMoment(ConnectOptions options, int64_t map);

  // The number of the map, with which all its rows begin.
  int64_t map() const { return row_.map; }

  // The connection, for reads; a new one if the last one broke, unless all is read at one moment.
  // UNAVAILABLE.
  absl::StatusOr<Connection*> connection();

  // What a commit changes in the row of the map, which makes the map complete.
  struct Advance {
    Revision from = 0;
    Revision to = 0;
    ObjectId next_object_id = 0;
    int64_t next_lineage = 0;
  };

  // Runs the statements that `add` sends in one transaction, durably and in one round trip. OK: it
  // is committed. On error nothing of it is stored, now or later. UNAVAILABLE; RESOURCE_EXHAUSTED;
  // errors of CheckCancelled and of `add`. DATA_LOSS, for ever, if another server owns the map by
  // now, or if it could not be found out whether the transaction was committed.
  absl::Status Write(absl::FunctionRef<absl::Status(Pipeline&)> add,
                     const std::optional<Advance>& advance = std::nullopt);

  // As Write, but `run` may wait for answers: a round trip for each, and two more.
  absl::Status WriteInSteps(absl::FunctionRef<absl::Status(Connection&)> run);

  // OK if no other server has owned the map until now. LostOwnershipError; UNAVAILABLE.
  absl::Status Confirm();

  // Lets any server open the map at once. Nothing may be written afterwards.
  void Release();

  // The reason for which nothing can be written any more; OK while there is none.
  const absl::Status& lost() const { return lost_; }

 private:
  absl::StatusOr<Connection*> ConnectionOfMoment();

  enum class Outcome { kStored, kNotStored };

  // Tells a transaction that failed or may have failed: `status` if nothing was stored.
  absl::Status Settle(const absl::Status& status, int64_t written);
  // Asks the row of the map, until it answers or time is up.
  absl::Status Resolve(const absl::Status& status, int64_t written);
  absl::StatusOr<Outcome> AskRow(int64_t written);
  // The reason for which the row refused the transaction; `status` if it did not.
  absl::Status Refusal(const absl::Status& status);
  absl::Status Lose(const absl::Status& reason);

  const ConnectOptions options_;
  std::unique_ptr<Connection> connection_;
  std::optional<Transaction> moment_;  // AtOneMoment; destroyed before the connection
  bool is_of_one_moment_ = false;
  Row row_;
  absl::Status lost_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_OWNED_MAP_H_
