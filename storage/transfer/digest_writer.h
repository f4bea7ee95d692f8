// The canonical encoding of what a map has, as the input of a digest.
#ifndef HYPERMAP_STORAGE_TRANSFER_DIGEST_WRITER_H_
#define HYPERMAP_STORAGE_TRANSFER_DIGEST_WRITER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/digest/sha256.h"
#include "map/edits/change.h"
#include "map/grid/tile.h"
#include "map/structure.h"
#include "storage/fusion_log.h"

namespace hypermap::storage {

// Numbers are 8 bytes, little-endian; times nanoseconds since the Unix epoch; texts have their
// length before them. Objects, layers and changes of structure are encoded as in the columns of
// stores (storage/encoding). The cells of a tile are floats of one NaN and one zero.
class DigestWriter {
 public:
  void Add(int64_t number);
  void Add(absl::Time time) { Add(absl::ToUnixNanos(time)); }
  void Add(absl::string_view text);
  // Null: there is none.
  absl::Status Add(const SemanticObject* object);
  void Add(const Tile* tile);
  absl::Status Add(const Change& change);
  absl::Status Add(const LayerStructure& layer);
  void Add(const FrameTree& frames);
  void Add(const LogKey& key);

  // The digest of all that was added, as hexadecimal digits.
  std::string Finish() &&;

 private:
  Sha256 digest_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_TRANSFER_DIGEST_WRITER_H_
