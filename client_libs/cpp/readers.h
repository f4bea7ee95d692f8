// Answers that arrive in parts, each once.
//
//   AnswerReader chairs = client.QueryValue("office", "chair");
//   for (const LayerPart& part : chairs) Show(part);
//   if (!chairs.status().ok()) return chairs.status();
#ifndef HYPERMAP_CLIENT_LIBS_CPP_READERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_READERS_H_

#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "client_libs/cpp/answers.h"

namespace hypermap::client {

// Where the parts come from. Destroying a source ends the call.
template <typename Part>
class PartSource {
 public:
  virtual ~PartSource() = default;
  // The next part; nullopt at the end and on an error. Blocks until there is one.
  virtual std::optional<Part> Next() = 0;
  // Why Next gave nothing: OK at the end of a complete answer.
  virtual const absl::Status& status() const = 0;
};

// Walks through what a reader gives, which is read on by each step. One at a time.
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

// An answer to an area or value question, layer after layer. Destroying it before the end tells the
// server to stop. Movable; one thread at a time.
class AnswerReader {
 public:
  struct RevisedPart {
    Revision revision = 0;
    std::optional<LayerPart> part;  // absent where there was no layer to ask
  };

  explicit AnswerReader(std::unique_ptr<PartSource<RevisedPart>> source);

  // The next part; nullopt at the end and on an error. Blocks until there is one.
  std::optional<LayerPart> Next();
  auto begin() { return ReaderIterator<AnswerReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or why the answer is not complete.
  const absl::Status& status() const { return source_->status(); }
  // The revision that the whole answer is read at; 0 before the first Next.
  Revision revision() const { return revision_; }

 private:
  std::unique_ptr<PartSource<RevisedPart>> source_;
  Revision revision_ = 0;
};

// A file that arrives piece after piece. Destroying it before the end tells the server to stop.
// Movable; one thread at a time.
class ByteReader {
 public:
  explicit ByteReader(std::unique_ptr<PartSource<std::string>> source);

  // The next piece; nullopt at the end and on an error. Blocks until there is one.
  std::optional<std::string> Next() { return source_->Next(); }
  auto begin() { return ReaderIterator<ByteReader>(this); }
  std::default_sentinel_t end() const { return {}; }
  // After the end: OK, or why the file is not complete.
  const absl::Status& status() const { return source_->status(); }

 private:
  std::unique_ptr<PartSource<std::string>> source_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_READERS_H_
