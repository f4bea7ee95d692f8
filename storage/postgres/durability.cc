#include "storage/postgres/durability.h"

#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kSettings[] =
    "SELECT current_setting('fsync'), current_setting('full_page_writes'), "
    "current_setting('synchronous_commit'), current_setting('synchronous_standby_names')";

struct Settings {
  std::string fsync;
  std::string full_page_writes;
  std::string synchronous_commit;
  std::string standbys;

  bool has_standby() const {
    return !standbys.empty() && synchronous_commit != "off" && synchronous_commit != "local";
  }
};

absl::StatusOr<Settings> ReadSettings(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kSettings));
  rows.Next();
  Settings settings{std::string(rows.Text(0)), std::string(rows.Text(1)), std::string(rows.Text(2)),
                    std::string(rows.Text(3))};
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return settings;
}

}  // namespace

absl::StatusOr<bool> AreCommitsConfirmed(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(const Settings settings, ReadSettings(connection));
  return settings.has_standby();
}

absl::StatusOr<std::vector<std::string>> FindRisks(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(const Settings settings, ReadSettings(connection));
  std::vector<std::string> risks;
  if (settings.fsync != "on") {
    risks.push_back("fsync is off: a power loss may damage the database");
  }
  if (settings.full_page_writes != "on") {
    risks.push_back("full_page_writes is off: a power loss may damage the database");
  }
  if (settings.synchronous_commit == "off") {
    risks.push_back("synchronous_commit is off: a crash of the database loses acknowledged edits");
  } else if (!settings.has_standby()) {
    risks.push_back(
        "no standby confirms commits: the loss of the primary, or a failover, may lose "
        "acknowledged "
        "edits (synchronous_standby_names, synchronous_commit)");
  }
  return risks;
}

}  // namespace hypermap::storage::postgres
