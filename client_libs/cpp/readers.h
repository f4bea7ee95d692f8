// Answers that arrive in parts, each of which can be read once.
//
//    AnswerReader chairs = client.QueryValue("office", "chair");
//    for (const LayerPart& part : chairs) Show(part);
//    if (!chairs.status().ok()) return chairs.status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_READERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_READERS_H_

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "client_libs/cpp/answers.h"

namespace hypermap::client {

// Source of the parts of an answer. Destroying a source ends the call.
template <typename Part>
class PartStream {
 public:
  virtual ~PartStream() = default;
  // Returns the next part; nullopt at the end and on an error. Blocks until there is one.
  virtual std::optional<Part> Next() = 0;
  // After Next returned nullopt: OK if the answer is complete, otherwise the error.
  virtual const absl::Status& status() const = 0;
};

// Input iterator over the items of a reader. Each step reads the next item, so a reader can have
// only one iterator.
template <typename Reader>
class ReaderIterator {
 public:
  using value_type = typename decltype(std::declval<Reader&>().Next())::value_type;
  using difference_type = std::ptrdiff_t;

  explicit ReaderIterator(Reader* reader) : reader_(reader), item_(reader->Next()) {}

  value_type& operator*() const { return *item_; }
  ReaderIterator& operator++() {
    item_ = reader_->Next();
    return *this;
  }
  void operator++(int) { ++*this; }
  friend bool operator==(const ReaderIterator& it, std::default_sentinel_t /*end*/) {
    return !it.item_.has_value();
  }

 private:
  Reader* reader_;
  mutable std::optional<value_type> item_;
};

// The answer to QueryArea or QueryValue, layer by layer. Destroying it before the end tells the
// server to stop. Movable; used by one thread at a time.
class AnswerReader {
 public:
  struct RevisedPart {
    Revision revision = 0;
    std::optional<LayerPart> part;  // absent if the query has no layers
    uint64_t incarnation = 0;
  };

  explicit AnswerReader(std::unique_ptr<PartStream<RevisedPart>> source);

  // Returns the next part; nullopt at the end and on an error. Blocks until there is one.
  std::optional<LayerPart> Next();
  auto begin() { return ReaderIterator<AnswerReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or the reason why the answer is incomplete.
  const absl::Status& status() const { return source_->status(); }
  // The revision at which the whole answer is read; 0 before the first Next.
  Revision revision() const { return revision_; }
  // The incarnation of the map to which the revision belongs; 0 before the first Next.
  uint64_t incarnation() const { return incarnation_; }

 private:
  std::unique_ptr<PartStream<RevisedPart>> source_;
  Revision revision_ = 0;
  uint64_t incarnation_ = 0;
};

// A file that arrives in pieces. Destroying the reader before the end tells the server to stop.
// Movable; used by one thread at a time.
class ByteReader {
 public:
  explicit ByteReader(std::unique_ptr<PartStream<std::string>> source);

  // Returns the next piece; nullopt at the end and on an error. Blocks until there is one.
  std::optional<std::string> Next() { return source_->Next(); }
  auto begin() { return ReaderIterator<ByteReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or the reason why the file is incomplete.
  const absl::Status& status() const { return source_->status(); }

 private:
  std::unique_ptr<PartStream<std::string>> source_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_READERS_H_
