// Messages in Protobuf's text format, for tests.
#ifndef HYPERMAP_CLIENT_LIBS_TESTING_TEXT_MESSAGE_H_
#define HYPERMAP_CLIENT_LIBS_TESTING_TEXT_MESSAGE_H_

#include <gtest/gtest.h>

#include <string>

#include "google/protobuf/text_format.h"

namespace hypermap::testing {

// Fails the test if `text` is not a `Message`.
template <typename Message>
Message ParseText(const std::string& text) {
  Message message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message;
}

}  // namespace hypermap::testing

#endif  // HYPERMAP_CLIENT_LIBS_TESTING_TEXT_MESSAGE_H_
