#include "server/rpc/correlation.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/random/random.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace hypermap::server {
namespace {

constexpr size_t kMaxRequestIdBytes = 128;
constexpr absl::string_view kSigns = "-_.:/+=";

// "VERSION-TRACE_ID-PARENT_ID-FLAGS": the fields of a traceparent, and its length in version 00.
// Later versions may have more after another dash.
constexpr size_t kTraceIdAt = 3;
constexpr size_t kTraceIdSize = 32;
constexpr size_t kParentIdAt = kTraceIdAt + kTraceIdSize + 1;
constexpr size_t kParentIdSize = 16;
constexpr size_t kFlagsAt = kParentIdAt + kParentIdSize + 1;
constexpr size_t kSize = kFlagsAt + 2;

// Lower case only, as the grammar says.
bool IsHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return ('0' <= c && c <= '9') || ('a' <= c && c <= 'f'); });
}

bool IsZero(absl::string_view text) { return text.find_first_not_of('0') == text.npos; }

}  // namespace

bool IsRequestId(absl::string_view id) {
  return !id.empty() && id.size() <= kMaxRequestIdBytes &&
         std::all_of(id.begin(), id.end(), [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
                  absl::StrContains(kSigns, c);
         });
}

std::string MakeRequestId() {
  absl::InsecureBitGen random;
  return absl::StrCat(absl::Hex(absl::Uniform<uint64_t>(random), absl::kZeroPad16));
}

absl::string_view TraceIdOf(absl::string_view traceparent) {
  if (traceparent.size() < kSize) return {};
  const absl::string_view version = traceparent.substr(0, 2);
  const absl::string_view rest = traceparent.substr(kSize);
  const absl::string_view trace_id = traceparent.substr(kTraceIdAt, kTraceIdSize);
  const absl::string_view parent_id = traceparent.substr(kParentIdAt, kParentIdSize);
  const bool has_dashes = traceparent[kTraceIdAt - 1] == '-' &&
                          traceparent[kParentIdAt - 1] == '-' && traceparent[kFlagsAt - 1] == '-';
  const bool has_digits = IsHex(version) && IsHex(trace_id) && IsHex(parent_id) &&
                          IsHex(traceparent.substr(kFlagsAt, 2));
  if (!has_dashes || !has_digits || version == "ff") return {};
  if (!rest.empty() && (version == "00" || rest[0] != '-')) return {};
  if (IsZero(trace_id) || IsZero(parent_id)) return {};
  return trace_id;
}

}  // namespace hypermap::server
