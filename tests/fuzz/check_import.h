// Checks that hold for any file that a decoder accepts.
#ifndef HYPERMAP_TESTS_FUZZ_CHECK_IMPORT_H_
#define HYPERMAP_TESTS_FUZZ_CHECK_IMPORT_H_

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "map/edits/apply.h"
#include "storage/interchange/imported_map.h"
#include "tests/fuzz/require.h"

namespace hypermap::storage {

// Small limits, so that a fuzzer reaches them.
inline Limits FuzzLimits() {
  Limits limits;
  limits.max_unpacked_bytes = 1 << 20;
  limits.max_archive_members = 20;
  limits.max_cells = 1 << 16;
  limits.max_import_objects = 1000;
  limits.max_vertices = 1000;
  return limits;
}

// Applies the import to `before` and returns the result. Returns null if the file was refused,
// which must be with one of the documented codes. Applying decoded edits may fail, too, but must
// not crash.
inline SnapshotPtr CheckImport(const absl::StatusOr<ImportedMap>& imported,
                               const Snapshot& before = {}) {
  if (!imported.ok()) {
    REQUIRE(absl::IsInvalidArgument(imported.status()) ||
            absl::IsResourceExhausted(imported.status()) || absl::IsNotFound(imported.status()) ||
            absl::IsFailedPrecondition(imported.status()));
    REQUIRE(!imported.status().message().empty());
    return nullptr;
  }
  const auto applied = Apply(before, imported->batch);
  return applied.ok() ? applied->snapshot : nullptr;
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_TESTS_FUZZ_CHECK_IMPORT_H_
