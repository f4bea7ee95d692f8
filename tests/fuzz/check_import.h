// What must hold of any file that a decoder takes.
#ifndef HYPERMAP_TESTS_FUZZ_CHECK_IMPORT_H_
#define HYPERMAP_TESTS_FUZZ_CHECK_IMPORT_H_

#include "absl/status/statusor.h"
#include "map/edits/apply.h"
#include "storage/interchange/imported_map.h"
#include "tests/fuzz/require.h"

namespace hypermap::storage {

// Small, so that a fuzzer meets them.
inline ImportLimits FuzzLimits() {
  return {.max_unpacked_bytes = 1 << 20,
          .max_archive_members = 20,
          .max_image_pixels = 1 << 16,
          .max_objects = 1000,
          .max_vertices_per_polygon = 1000};
}

// The map that the import makes of `before`; null when the file was refused, which must be with one
// of the documented codes. Applying what a decoder took may be refused too, but not by a crash.
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
