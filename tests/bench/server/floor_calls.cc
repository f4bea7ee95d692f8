#include "tests/bench/server/floor_calls.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/bench/server/floor.pb.h"

namespace hypermap::bench {
namespace {

constexpr char kFloorService[] = "/hypermap.bench.FloorService/";

}  // namespace

Calls EmptyCalls() {
  return {absl::StrCat(kFloorService, "Empty"), false, InTurn({ToBytes(EmptyRequest())})};
}

Calls CallsOfSizes(const std::vector<std::string>& answers, bool streamed) {
  std::vector<grpc::ByteBuffer> requests;
  for (const std::string& answer : answers) {
    AnswerRequest request;
    // The field's tag and length come before the bytes.
    request.set_num_bytes(std::max(0, static_cast<int>(answer.size()) - 3));
    requests.push_back(ToBytes(request));
  }
  return {absl::StrCat(kFloorService, streamed ? "StreamedAnswer" : "Answer"), streamed,
          InTurn(std::move(requests))};
}

}  // namespace hypermap::bench
