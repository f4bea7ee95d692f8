// What the settings of a database promise for commits.
#ifndef HYPERMAP_STORAGE_POSTGRES_DURABILITY_H_
#define HYPERMAP_STORAGE_POSTGRES_DURABILITY_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Returns a sentence for each way in which acknowledged commits can be lost: by a power loss of the
// primary, or by its loss for good. None: a standby confirms each commit.
absl::StatusOr<std::vector<std::string>> FindRisks(Connection* connection);

// Whether a standby confirms each commit of this session, by the settings of now.
absl::StatusOr<bool> AreCommitsConfirmed(Connection* connection);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_DURABILITY_H_
