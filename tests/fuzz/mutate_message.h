// Mutations of Protobuf messages that keep them well-formed, for LLVMFuzzerCustomMutator.
#ifndef HYPERMAP_TESTS_FUZZ_MUTATE_MESSAGE_H_
#define HYPERMAP_TESTS_FUZZ_MUTATE_MESSAGE_H_

#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/random_values.h"

namespace hypermap::fuzz {

// Changes one random field of the message or of a message in it: sets it to a random or an extreme
// value, clears it, or adds, repeats or removes an element. Messages in which the mutation adds a
// message are at most ten deep.
void MutateMessage(google::protobuf::Message* message, Rng& rng);

// Body of LLVMFuzzerCustomMutator for an input that is `message` in text format. Replaces the bytes
// by a mutation and returns their number. Bytes that are not such a text count as an empty message.
size_t MutateText(google::protobuf::Message* message, uint8_t* data, size_t size, size_t max_size,
                  unsigned seed);

// The same for an input that is the serialized message. Every second mutation is one of libFuzzer's
// own, which makes bytes that do not parse.
size_t MutateBytes(google::protobuf::Message* message, uint8_t* data, size_t size, size_t max_size,
                   unsigned seed);

// Parses the text format. Returns whether `text` is such a message.
bool ParseText(const uint8_t* data, size_t size, google::protobuf::Message* message);

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_MUTATE_MESSAGE_H_
