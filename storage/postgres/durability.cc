#include "storage/postgres/durability.h"

#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kSettings[] =
    "SELECT current_setting('fsync'), current_setting('full_page_writes'), "
    "current_setting('synchronous_commit'), current_setting('synchronous_standby_names')";

}  // namespace

absl::StatusOr<std::vector<std::string>> FindRisks(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kSettings));
  rows.Next();
  const std::string fsync(rows.Text(0));
  const std::string full_page_writes(rows.Text(1));
  const std::string synchronous_commit(rows.Text(2));
  const std::string standbys(rows.Text(3));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  std::vector<std::string> risks;
  if (fsync != "on") risks.push_back("fsync is off: a power loss may damage the database");
  if (full_page_writes != "on") {
    risks.push_back("full_page_writes is off: a power loss may damage the database");
  }
  if (synchronous_commit == "off") {
    risks.push_back("synchronous_commit is off: a crash of the database loses acknowledged edits");
  } else if (standbys.empty() || synchronous_commit == "local") {
    risks.push_back(
        "no standby confirms commits: the loss of the primary, or a failover, may lose "
        "acknowledged "
        "edits (synchronous_standby_names, synchronous_commit)");
  }
  return risks;
}

}  // namespace hypermap::storage::postgres
