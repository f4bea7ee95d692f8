#include "storage/libpq/errors.h"

#include <optional>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kSqlState[] = "hypermap/sqlstate";

struct Mapping {
  absl::string_view prefix;  // of the SQLSTATE
  absl::StatusCode code;
};

// The first match counts. The states are those of appendix A of PostgreSQL's manual.
constexpr Mapping kMappings[] = {
    {"08", absl::StatusCode::kUnavailable},            // connection exception
    {"22021", absl::StatusCode::kInvalidArgument},     // character not in repertoire
    {"22P05", absl::StatusCode::kInvalidArgument},     // untranslatable character
    {"23505", absl::StatusCode::kAlreadyExists},       // unique violation
    {"25006", absl::StatusCode::kUnavailable},         // read-only transaction: a standby
    {"25P03", absl::StatusCode::kUnavailable},         // idle in transaction for too long
    {"28", absl::StatusCode::kFailedPrecondition},     // invalid role or password
    {"3D000", absl::StatusCode::kFailedPrecondition},  // no such database
    {"40", absl::StatusCode::kUnavailable},            // serialization failure, deadlock
    {"42501", absl::StatusCode::kFailedPrecondition},  // insufficient privilege
    {"53300", absl::StatusCode::kUnavailable},         // too many connections
    {"53", absl::StatusCode::kResourceExhausted},      // disk full, out of memory
    {"54", absl::StatusCode::kResourceExhausted},      // too large
    {"55P03", absl::StatusCode::kUnavailable},         // a lock is not to be had in time
    {"57P04", absl::StatusCode::kFailedPrecondition},  // the database was dropped
    {"57", absl::StatusCode::kUnavailable},  // shutdown, startup, cancelled by an operator
    {"58P01", absl::StatusCode::kDataLoss},  // a file of the database is missing
    {"58", absl::StatusCode::kUnavailable},  // a call of the system failed
    {"XX001", absl::StatusCode::kDataLoss},  // data corrupted
    {"XX002", absl::StatusCode::kDataLoss},  // index corrupted
};

absl::StatusCode CodeOf(absl::string_view sqlstate) {
  for (const Mapping& mapping : kMappings) {
    if (sqlstate.substr(0, mapping.prefix.size()) == mapping.prefix) return mapping.code;
  }
  return absl::StatusCode::kInternal;
}

}  // namespace

std::string SqlStateOf(const absl::Status& status) {
  const absl::optional<absl::Cord> state = status.GetPayload(kSqlState);
  return state ? std::string(*state) : "";
}

absl::Status DatabaseError(absl::string_view sqlstate, absl::string_view message) {
  absl::Status status(CodeOf(sqlstate), absl::StrCat(message, " (SQLSTATE ", sqlstate, ")"));
  status.SetPayload(kSqlState, absl::Cord(sqlstate));
  return status;
}

}  // namespace hypermap::storage::postgres
