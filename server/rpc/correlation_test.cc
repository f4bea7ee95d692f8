#include "server/rpc/correlation.h"

#include <gtest/gtest.h>

#include <string>

namespace hypermap::server {
namespace {

constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";

TEST(CorrelationTest, RequestIdsAreShortAndPlain) {
  for (const char* id : {"a", "7f0c-11", "robot-7/claim:12", "Zm9v+b==", "2026-11-27T09.00"}) {
    EXPECT_TRUE(IsRequestId(id)) << id;
  }
  for (const char* id : {"", "two words", "a\"b", "a\nb", "caf\xc3\xa9", "a,b", "a\\b"}) {
    EXPECT_FALSE(IsRequestId(id)) << id;
  }
  EXPECT_TRUE(IsRequestId(std::string(128, 'x')));
  EXPECT_FALSE(IsRequestId(std::string(129, 'x')));
}

TEST(CorrelationTest, MadeRequestIdsDiffer) {
  EXPECT_TRUE(IsRequestId(MakeRequestId()));
  EXPECT_EQ(MakeRequestId().size(), 16u);
  EXPECT_NE(MakeRequestId(), MakeRequestId());
}

TEST(CorrelationTest, TraceIdOfATraceparent) {
  for (const char* traceparent :
       {"00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-00",
        "cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-what-comes-later"}) {
    EXPECT_EQ(TraceIdOf(traceparent), kTraceId) << traceparent;
  }
}

TEST(CorrelationTest, OtherTraceparentsAreIgnored) {
  for (const char* traceparent :
       {"", "00", "-", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",
        // Version 00 with more than that version has, or with more without a dash.
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
        "cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01.more",
        // The version that is none, and ids that are.
        "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
        // Not lower case, no digits, no dashes.
        "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e473g-00f067aa0ba902b7-01",
        "0x-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-0x",
        "00_4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"}) {
    EXPECT_EQ(TraceIdOf(traceparent), "") << traceparent;
  }
}

}  // namespace
}  // namespace hypermap::server
