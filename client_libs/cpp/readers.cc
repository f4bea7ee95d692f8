#include "client_libs/cpp/readers.h"

#include <utility>

namespace hypermap::client {

AnswerReader::AnswerReader(std::unique_ptr<PartStream<RevisedPart>> source)
    : source_(std::move(source)) {}

std::optional<LayerPart> AnswerReader::Next() {
  while (std::optional<RevisedPart> next = source_->Next()) {
    revision_ = next->revision;
    incarnation_ = next->incarnation;
    if (next->part) return std::move(next->part);
  }
  return std::nullopt;
}

ByteReader::ByteReader(std::unique_ptr<PartStream<std::string>> source)
    : source_(std::move(source)) {}

}  // namespace hypermap::client
