// What the text of a statement tells. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_STATEMENTS_H_
#define HYPERMAP_STORAGE_LIBPQ_STATEMENTS_H_

#include "absl/strings/string_view.h"

namespace hypermap::storage::postgres {

bool IsBegin(absl::string_view sql);
bool IsCommit(absl::string_view sql);

// Whether the statement, or one of the script, may commit something that was written; true in
// doubt, and of BEGIN. `in_transaction`: whether a transaction is open before it.
bool MayCommit(absl::string_view sql, bool in_transaction);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_STATEMENTS_H_
