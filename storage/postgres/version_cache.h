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
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Content with up to so many bytes is sent with the versions that are found, because to ask for it
// takes longer than to send it, even if some of it is cached.
inline constexpr int64_t kBytesAtOnce = 64 << 10;

// Returns a connection that is at the caller's disposal, which may have to end what it does before.
using GetConnection = absl::FunctionRef<absl::StatusOr<Connection*>()>;

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

  // Reads the content of different versions. Errors of all methods: DATA_LOSS naming a row that is
  // damaged or missing; errors of TakeMemory, CheckCancelled and `fetch`.
  class Reading {
   public:
    explicit Reading(VersionCache* cache) : cache_(cache) {}

    // Adds a version whose content Finish fetches, if it is not in the cache.
    absl::Status Add(Version version) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      contents_.push_back(cache_->cache_.Find(version.key()));
      if (contents_.back() != nullptr) return TakeMemoryOf(contents_.back());
      missing_.push_back({std::move(version), contents_.size() - 1});
      return absl::OkStatus();
    }
    // Adds a version whose content is at hand. It is decoded if it is not in the cache.
    absl::Status Add(const Version& version, absl::FunctionRef<absl::StatusOr<Content>()> decode) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      contents_.push_back(cache_->cache_.Find(version.key()));
      if (contents_.back() != nullptr) return TakeMemoryOf(contents_.back());
      return Take(version, decode(), &contents_.back());
    }

    // Returns the content in the order of the versions, and forgets it.
    absl::StatusOr<std::vector<Content>> Finish(Fetch fetch) {
      for (size_t begin = 0; begin < missing_.size();) {
        std::vector<Version> batch;
        int64_t bytes = 0;
        while (begin + batch.size() < missing_.size() && bytes < kEnoughBytes &&
               batch.size() < kMaxRows) {
          batch.push_back(missing_[begin + batch.size()].version);
          bytes += batch.back().bytes;
        }
        HYPERMAP_RETURN_IF_ERROR(FetchBatch(batch, begin, fetch));
        begin += batch.size();
      }
      missing_.clear();
      return std::exchange(contents_, {});
    }

   private:
    struct Missing {
      Version version;
      size_t place;  // of the version among all
    };

    absl::Status FetchBatch(absl::Span<const Version> batch, size_t begin, Fetch fetch) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      const auto take = [&](size_t number, absl::StatusOr<Content> content) -> absl::Status {
        return Take(batch.at(number), std::move(content),
                    &contents_[missing_[begin + number].place]);
      };
      HYPERMAP_RETURN_IF_ERROR(fetch(batch, take));
      for (size_t i = 0; i < batch.size(); ++i) {
        if (contents_[missing_[begin + i].place] == nullptr) return Damaged(batch[i], "is missing");
      }
      return absl::OkStatus();
    }

    absl::Status Take(const Version& version, absl::StatusOr<Content> content, Content* place) {
      if (!content.ok()) return Damaged(version, content.status().message());
      HYPERMAP_RETURN_IF_ERROR(TakeMemoryOf(*content));
      cache_->cache_.Insert(version.key(), *content, BytesOf(*content));
      *place = *std::move(content);
      return absl::OkStatus();
    }

    static int64_t BytesOf(const Content& content) {
      return kBytesOfPlaces + Version::BytesOf(content);
    }
    static absl::Status TakeMemoryOf(const Content& content) {
      return TakeMemory(BytesOf(content));
    }
    static absl::Status Damaged(const Version& version, absl::string_view problem) {
      return absl::DataLossError(absl::StrCat(version.Name(), ": ", problem));
    }

    VersionCache* const cache_;
    std::vector<Content> contents_;
    std::vector<Missing> missing_;
  };

 private:
  using Key = decltype(std::declval<const Version&>().key());

  // Memory of the content's places in the cache and in an answer's index.
  static constexpr int64_t kBytesOfPlaces = 256;
  // Bounds of one statement, whose answer is in memory as a whole and is not charged.
  static constexpr int64_t kEnoughBytes = 4 << 20;
  static constexpr size_t kMaxRows = 4096;

  GenerationCache<Key, Content> cache_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_VERSION_CACHE_H_
