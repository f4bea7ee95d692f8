// Reads rows of versions by way of a cache, and in amounts of bounded size.
#ifndef HYPERMAP_STORAGE_POSTGRES_VERSION_CACHE_H_
#define HYPERMAP_STORAGE_POSTGRES_VERSION_CACHE_H_

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/generation_cache.h"

namespace hypermap::storage::postgres {

// `Version` tells a row and the bytes that are read for it; `Content` is a pointer to what is
// decoded from it. A Version has:
//   Key key() const                          never stands for other content
//   int64_t bytes
//   std::string Name() const                 names the row in errors
//   static int64_t BytesOf(const Content&)   the memory of the content
template <typename Version, typename Content>
class VersionCache {
 public:
  explicit VersionCache(CacheRoomPtr room) : cache_(std::move(room)) {}

  // Takes the content of one of the versions that a statement was made for.
  using Take = absl::FunctionRef<absl::Status(size_t number, absl::StatusOr<Content> content)>;
  // Reads versions with one statement, in any order.
  using Fetch = absl::FunctionRef<absl::Status(absl::Span<const Version> versions, Take take)>;

  // Returns the content of different versions, in their order, and takes its memory. DATA_LOSS
  // naming a row that is damaged or missing; errors of TakeMemory, CheckCancelled and `fetch`.
  absl::StatusOr<std::vector<Content>> Read(absl::Span<const Version> versions, Fetch fetch) {
    std::vector<Content> contents(versions.size());
    Batch batch;
    for (size_t i = 0; i < versions.size(); ++i) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      contents[i] = cache_.Find(versions[i].key());
      if (contents[i] != nullptr) {
        HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfPlaces + Version::BytesOf(contents[i])));
        continue;
      }
      batch.versions.push_back(versions[i]);
      batch.places.push_back(i);
      batch.bytes += versions[i].bytes;
      if (batch.bytes < kEnoughBytes && batch.places.size() < kMaxRows) continue;
      HYPERMAP_RETURN_IF_ERROR(ReadBatch(batch, fetch, &contents));
      batch = {};
    }
    if (!batch.places.empty()) HYPERMAP_RETURN_IF_ERROR(ReadBatch(batch, fetch, &contents));
    return contents;
  }

 private:
  using Key = decltype(std::declval<const Version&>().key());

  // Memory of the content's places in the cache and in an answer's index.
  static constexpr int64_t kBytesOfPlaces = 256;
  // Bounds of one statement, whose answer is in memory as a whole and is not charged.
  static constexpr int64_t kEnoughBytes = 4 << 20;
  static constexpr size_t kMaxRows = 4096;

  struct Batch {
    std::vector<Version> versions;
    std::vector<size_t> places;  // of the versions among all
    int64_t bytes = 0;
  };

  absl::Status ReadBatch(const Batch& batch, Fetch fetch, std::vector<Content>* contents) {
    const auto take = [&](size_t number, absl::StatusOr<Content> content) -> absl::Status {
      const Version& version = batch.versions.at(number);
      if (!content.ok()) return Damaged(version, content.status().message());
      const int64_t bytes = kBytesOfPlaces + Version::BytesOf(*content);
      HYPERMAP_RETURN_IF_ERROR(TakeMemory(bytes));
      cache_.Insert(version.key(), *content, bytes);
      (*contents)[batch.places[number]] = *std::move(content);
      return absl::OkStatus();
    };
    HYPERMAP_RETURN_IF_ERROR(fetch(batch.versions, take));
    for (size_t i = 0; i < batch.places.size(); ++i) {
      if ((*contents)[batch.places[i]] == nullptr) return Damaged(batch.versions[i], "is missing");
    }
    return absl::OkStatus();
  }

  static absl::Status Damaged(const Version& version, absl::string_view problem) {
    return absl::DataLossError(absl::StrCat(version.Name(), ": ", problem));
  }

  GenerationCache<Key, Content> cache_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_VERSION_CACHE_H_
