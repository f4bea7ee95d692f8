// The messages of QueryArea and QueryValue.
#ifndef HYPERMAP_SERVER_SERVICES_PART_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_PART_SOURCE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "base/limits/limits.h"
#include "map/query/query.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"
#include "wire/answer.h"

namespace hypermap::server {

// Turns the parts of an answer (see EmptyPartFilter) into messages: each part into one message, or
// several if its objects are large. If the scope has no layers, one message contains only the
// revision and the incarnation.
template <typename Response>
class PartSource : public MessageSource<Response> {
 public:
  using Step = typename MessageSource<Response>::Step;

  PartSource(std::unique_ptr<PartReader> reader, Revision revision, uint64_t incarnation,
             const Limits& limits)
      : reader_(std::move(reader)),
        revision_(revision),
        incarnation_(incarnation),
        chunk_items_(limits.chunk_items),
        max_chunk_bytes_(limits.max_chunk_bytes) {}

  absl::StatusOr<Step> Next(Response* message) override {
    if (!part_ && reader_->done()) {
      if (told_revision_) return Step::kEnd;
      TellRevision(message);
      return Step::kMessage;
    }
    if (!part_ && !TakePart()) return Step::kNothingYet;
    TellRevision(message);
    next_object_ =
        wire::EncodeLayerPart(*part_, next_object_, max_chunk_bytes_, message->mutable_part());
    if (next_object_ == part_->part.objects.size()) part_.reset();
    return Step::kMessage;
  }

  bool done() const override { return !part_ && reader_->done() && told_revision_; }

  int64_t items() const override { return items_; }

 private:
  void TellRevision(Response* message) {
    message->set_revision(revision_);
    message->set_incarnation(incarnation_);
    told_revision_ = true;
  }

  // Reads the next part. Returns whether it belongs to the answer.
  bool TakePart() {
    LayerAnswerPart part = reader_->Next(chunk_items_);
    if (!filter_.Keeps(part)) return false;
    items_ += static_cast<int64_t>(part.part.objects.size() + part.part.runs.size());
    part_ = std::move(part);
    next_object_ = 0;
    return true;
  }

  const std::unique_ptr<PartReader> reader_;
  const Revision revision_;
  const uint64_t incarnation_;
  const int chunk_items_;
  const int64_t max_chunk_bytes_;
  EmptyPartFilter filter_;
  std::optional<LayerAnswerPart> part_;  // the part that is being encoded
  size_t next_object_ = 0;  // index in part_ of the first object that was not encoded yet
  bool told_revision_ = false;
  int64_t items_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_PART_SOURCE_H_
