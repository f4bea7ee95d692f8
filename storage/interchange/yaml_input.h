// The stream through which yaml-cpp reads a text.
//
// yaml-cpp reads ahead of the events that it reports: it queues the tokens of a whole list or map
// in flow style until it knows whether that is the key of another map. The queue takes up to 240
// times the bytes of the text. So a YamlInput takes memory for each piece of the text before the
// parser gets it:
//
//   YamlInput input(text);
//   std::istream stream(&input);
//   YAML::Parser(stream).HandleNextDocument(handler);
//   HYPERMAP_RETURN_IF_ERROR(input.status());
//
// The text ends early when the memory is refused or the work of this thread is cancelled. Then the
// status tells why, and what the parser reports has no meaning, errors included.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_YAML_INPUT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_YAML_INPUT_H_

#include <cstddef>
#include <cstdint>
#include <streambuf>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/metering/memory_meter.h"

namespace hypermap::storage {

// Gives back, when it is destroyed, the memory that it took. Not thread safe.
class YamlInput final : public std::streambuf {
 public:
  // `text` must outlive this.
  explicit YamlInput(absl::string_view text) : text_(text) {}
  ~YamlInput() override;

  // OK, or the error of CheckCancelled or TakeMemory that has ended the text.
  const absl::Status& status() const { return status_; }

  // Gives back the memory of the text before `position`. REQUIRES: the text is UTF-8, the parser
  // has reported an event at `position` (YAML::Mark::pos), and the handler keeps nothing of the
  // events before.
  void Release(int64_t position);

 protected:
  int_type underflow() override;

 private:
  // Takes memory for the text from `read_` to `end`.
  absl::Status Take(size_t end);
  // Bytes of memory that yaml-cpp keeps for a character until the end of the document. Called for
  // one character after another.
  int64_t BytesToKeep(size_t index);

  const absl::string_view text_;
  MemoryMeter* const meter_ = MemoryMeter::Current();
  absl::Status status_;
  size_t read_ = 0;      // by the parser
  size_t released_ = 0;  // of what is read
  int64_t taken_bytes_ = 0;
  size_t indentation_ = 0;  // of the line that is being read
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_YAML_INPUT_H_
