#include "client_libs/cpp/readers.h"

#include <utility>

namespace hypermap::client {

AnswerReader::AnswerReader(std::unique_ptr<PartSource<RevisedPart>> source)
    : source_(std::move(source)) {}

std::optional<LayerPart> AnswerReader::Next() {
  std::optional<RevisedPart> next = source_->Next();
  if (!next.has_value()) return std::nullopt;
  revision_ = next->revision;
  return std::move(next->part);
}

ByteReader::ByteReader(std::unique_ptr<PartSource<std::string>> source)
    : source_(std::move(source)) {}

}  // namespace hypermap::client
