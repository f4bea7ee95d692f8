// Queries of past revisions, and queries that wait for one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/time/testing/manual_clock.h"
#include "server/rpc/revision_wait.h"
#include "server/services/testing/test_server.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

constexpr char kLayer[] = "things";
const absl::Time kBegin = absl::FromUnixSeconds(1'000'000);

// The map "site" at revision 1: semantic "things", occupancy "cells", each in a frame of its own.
class PastQueryTest : public ::testing::Test {
 protected:
  PastQueryTest() : server_({}, 1 << 20, Options()) {
    LayerSpec things;
    things.name = kLayer;
    things.frame_id = "base";
    EditBatch batch = LayerOfCells("cells", 4, 4);
    batch.edits.push_back(hypermap::SetTransform{{"map", "base", PlanarTransform(1, 2, 0.5)}});
    batch.edits.push_back(hypermap::CreateLayer{things});
    server_.MakeMap("site", std::move(batch));
  }

  // The first commit is made at kBegin + 1 s, each further one a second later.
  SessionOptions Options() {
    SessionOptions options;
    options.limits.history_age = absl::InfiniteDuration();
    options.clock = std::make_shared<ServerClock>(&machine_);
    return options;
  }

  MapSession& session() { return **server_.site().Find("site"); }
  Revision Edit(std::vector<hypermap::Edit> edits) {
    machine_.Advance(absl::Seconds(1));
    const auto receipt = session().SubmitAndWait({{std::move(edits)}, "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }

  static hypermap::PutObject Thing(double x, double y, ObjectId id = 0) {
    hypermap::PutObject put{kLayer, {}, ""};
    put.object.id = id;
    put.object.label = x > 0 ? "cup" : "chair";
    put.object.shape = Polygon::FromBox({{x, y}, {x + 1, y + 1}});
    return put;
  }

  // A random edit; `live` are the existing objects.
  static hypermap::Edit SomeEdit(std::mt19937& random, std::vector<ObjectId>* live) {
    const auto place = [&] { return std::uniform_real_distribution<>(-10, 10)(random); };
    const size_t which = live->empty() ? 0 : random() % live->size();
    const ObjectId id = live->empty() ? 0 : (*live)[which];
    switch (random() % 8) {
      case 0:
      case 1:
        return Thing(place(), place());
      case 2:
      case 3:
        return Thing(place(), place(), id);
      case 4:
        if (id == 0) return Thing(place(), place());
        live->erase(live->begin() + static_cast<std::ptrdiff_t>(which));
        return hypermap::DeleteObject{kLayer, id, {}};
      case 5:
        return hypermap::SetTransform{{"map", "base", PlanarTransform(place(), place(), place())}};
      default: {
        const int32_t row = static_cast<int32_t>(random() % 300) - 150;
        const int32_t col = static_cast<int32_t>(random() % 300) - 150;
        return hypermap::WriteCells{"cells", {row, row + 1, col, col + 2}, {1.0, 0.25}};
      }
    }
  }

  template <typename Request>
  static Request Ask() {
    Request request;
    request.mutable_scope()->set_map("site");
    return request;
  }

  // The answers to one query of each kind as text, without the revision.
  std::string Answers(const std::function<void(v1::AsOf*)>& as_of, unsigned place_seed) {
    std::mt19937 random(place_seed);
    const auto place = [&] { return std::uniform_real_distribution<>(-10, 10)(random); };
    const Point p{place(), place()};
    std::string all;
    auto point = Ask<v1::QueryPointRequest>();
    wire::EncodePoint(p, point.mutable_point());
    as_of(point.mutable_as_of());
    {
      grpc::ClientContext context;
      v1::QueryPointResponse response;
      EXPECT_TRUE(server_.query->QueryPoint(&context, point, &response).ok());
      all += response.DebugString();
    }
    auto nearest = Ask<v1::QueryNearestRequest>();
    wire::EncodePoint(p, nearest.mutable_point());
    nearest.set_value("cup");
    nearest.set_k(3);
    as_of(nearest.mutable_as_of());
    {
      grpc::ClientContext context;
      v1::QueryNearestResponse response;
      EXPECT_TRUE(server_.query->QueryNearest(&context, nearest, &response).ok());
      all += response.DebugString();
    }
    auto area = Ask<v1::QueryAreaRequest>();
    wire::EncodePolygon(Polygon::FromBox({p, {p.x + 6, p.y + 6}}), area.mutable_area());
    as_of(area.mutable_as_of());
    {
      grpc::ClientContext context;
      auto reader = server_.query->QueryArea(&context, area);
      for (const auto& response : ReadAll(*reader)) all += response.DebugString();
      EXPECT_TRUE(reader->Finish().ok());
    }
    for (const char* value : {"chair", ">0.5"}) {
      auto search = Ask<v1::QueryValueRequest>();
      search.set_value(value);
      as_of(search.mutable_as_of());
      grpc::ClientContext context;
      auto reader = server_.query->QueryValue(&context, search);
      for (const auto& response : ReadAll(*reader)) all += response.DebugString();
      EXPECT_TRUE(reader->Finish().ok());
    }
    return all;
  }

  grpc::Status PointError(const std::function<void(v1::QueryPointRequest*)>& change) {
    auto request = Ask<v1::QueryPointRequest>();
    request.mutable_point();
    change(&request);
    v1::QueryPointResponse response;
    grpc::ClientContext context;
    return server_.query->QueryPoint(&context, request, &response);
  }

  ManualClock machine_{kBegin + absl::Seconds(1)};
  TestServer server_;
};

TEST_F(PastQueryTest, AnswersAreThoseThatWereGivenThen) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::mt19937 random(seed);
  constexpr int kEdits = 60;
  std::vector<ObjectId> live;
  std::vector<std::string> given{"", Answers([](auto*) {}, seed)};
  for (int i = 0; i < kEdits; ++i) {
    machine_.Advance(absl::Seconds(1));
    const auto receipt = session().SubmitAndWait({{{SomeEdit(random, &live)}}, "test", ""});
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    const ObjectId id = receipt->object_ids[0];
    if (id != 0 && std::find(live.begin(), live.end(), id) == live.end()) live.push_back(id);
    given.push_back(Answers([](auto*) {}, seed + i + 1));
  }
  for (Revision revision = 1; revision <= kEdits + 1; ++revision) {
    SCOPED_TRACE(absl::StrCat("revision ", revision));
    const auto place_seed = static_cast<unsigned>(seed + revision - 1);
    EXPECT_EQ(Answers([&](v1::AsOf* as_of) { as_of->set_at_revision(revision); }, place_seed),
              given[revision]);
    const absl::Time made = kBegin + absl::Seconds(revision);
    EXPECT_EQ(Answers([&](v1::AsOf* as_of) { wire::EncodeTime(made, as_of->mutable_at_time()); },
                      place_seed),
              given[revision]);
    if (revision > kEdits) break;
    const absl::Time just_before_next = made + absl::Milliseconds(999);
    EXPECT_EQ(
        Answers(
            [&](v1::AsOf* as_of) { wire::EncodeTime(just_before_next, as_of->mutable_at_time()); },
            place_seed),
        given[revision]);
  }
}

TEST_F(PastQueryTest, LayerThatWasNotThereYetIsUnknown) {
  const grpc::Status status = PointError([](v1::QueryPointRequest* request) {
    request->mutable_scope()->add_layers(kLayer);
    request->mutable_as_of()->set_at_revision(0);
  });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(PastQueryTest, RevisionsAndTimesThatAreToComeAreRefused) {
  const grpc::Status revision = PointError(
      [](v1::QueryPointRequest* request) { request->mutable_as_of()->set_at_revision(2); });
  EXPECT_EQ(revision.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_THAT(revision.error_message(), HasSubstr("newest is 1"));
  const grpc::Status time = PointError([](v1::QueryPointRequest* request) {
    wire::EncodeTime(kBegin + absl::Hours(1), request->mutable_as_of()->mutable_at_time());
  });
  EXPECT_EQ(time.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  const grpc::Status negative = PointError(
      [](v1::QueryPointRequest* request) { request->mutable_as_of()->set_at_revision(-1); });
  EXPECT_EQ(negative.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const grpc::Status before_all = PointError([](v1::QueryPointRequest* request) {
    wire::EncodeTime(kBegin - absl::Hours(1), request->mutable_as_of()->mutable_at_time());
  });
  EXPECT_EQ(before_all.error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST_F(PastQueryTest, QuestionWaitsForTheRevisionItNeedsAndHoldsNoThread) {
  // More calls than there are workers.
  constexpr int kWaiting = 8;
  server_.disk().Hold();
  std::vector<std::thread> waiting;
  for (int i = 0; i < kWaiting; ++i) {
    waiting.emplace_back([this, i] {
      if (i % 2 == 0) {
        auto request = Ask<v1::QueryPointRequest>();
        request.mutable_point();
        request.mutable_as_of()->set_min_revision(3);
        v1::QueryPointResponse response;
        grpc::ClientContext context;
        EXPECT_TRUE(server_.query->QueryPoint(&context, request, &response).ok());
        EXPECT_GE(response.revision(), 3);
        return;
      }
      auto request = Ask<v1::QueryAreaRequest>();
      wire::EncodePolygon(Polygon::FromBox({{0, 0}, {1, 1}}), request.mutable_area());
      request.mutable_as_of()->set_min_revision(3);
      request.mutable_as_of()->set_at_revision(3);
      grpc::ClientContext context;
      auto reader = server_.query->QueryArea(&context, request);
      const auto responses = ReadAll(*reader);
      EXPECT_TRUE(reader->Finish().ok());
      ASSERT_FALSE(responses.empty());
      EXPECT_EQ(responses[0].revision(), 3);
    });
  }
  // Other calls are answered meanwhile.
  EXPECT_TRUE(PointError([](v1::QueryPointRequest*) {}).ok());
  server_.disk().Release();
  Edit({Thing(0, 0)});
  EXPECT_TRUE(PointError([](v1::QueryPointRequest*) {}).ok());
  Edit({Thing(0, 0)});
  for (std::thread& thread : waiting) thread.join();
}

TEST_F(PastQueryTest, RevisionThatIsThereIsNotWaitedFor) {
  EXPECT_TRUE(PointError([](v1::QueryPointRequest* request) {
                request->mutable_as_of()->set_min_revision(1);
              }).ok());
  EXPECT_EQ(PointError([](v1::QueryPointRequest* request) {
              request->mutable_as_of()->set_min_revision(-1);
            }).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(PointError([](v1::QueryPointRequest* request) {
              request->mutable_scope()->set_map("attic");
              request->mutable_as_of()->set_min_revision(7);
            }).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(PastQueryTest, WaitEndsAtTheDeadline) {
  auto request = Ask<v1::QueryPointRequest>();
  request.mutable_point();
  request.mutable_as_of()->set_min_revision(100);
  v1::QueryPointResponse response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  EXPECT_EQ(server_.query->QueryPoint(&context, request, &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  auto area = Ask<v1::QueryValueRequest>();
  area.set_value("cup");
  area.mutable_as_of()->set_min_revision(100);
  grpc::ClientContext stream_context;
  stream_context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  auto reader = server_.query->QueryValue(&stream_context, area);
  EXPECT_TRUE(ReadAll(*reader).empty());
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(PastQueryTest, RevisionThatWasSeenIsWaitedForAShortTime) {
  const auto seen = [this](Revision revision, uint64_t incarnation) {
    return PointError([=](v1::QueryPointRequest* request) {
      request->mutable_as_of()->set_seen_revision(revision);
      request->mutable_as_of()->set_seen_incarnation(incarnation);
    });
  };
  const uint64_t incarnation = session().incarnation();
  EXPECT_TRUE(seen(1, incarnation).ok());
  EXPECT_TRUE(seen(99, incarnation + 1).ok());  // of another map of this name
  EXPECT_EQ(seen(-1, incarnation).error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  std::thread editing([this] { Edit({Thing(0, 0)}); });
  EXPECT_TRUE(seen(2, incarnation).ok());
  editing.join();

  const absl::Time begin = absl::Now();
  const grpc::Status never = seen(99, incarnation);
  EXPECT_EQ(never.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(never.error_message(), HasSubstr("the caller has seen 99"));
  EXPECT_GE(absl::Now() - begin, RevisionWait::kSeen);
}

TEST_F(PastQueryTest, RevisionThatWasSeenIsWaitedForInLinearizableQueriesToo) {
  const uint64_t incarnation = session().incarnation();
  const auto error = [&](Revision seen) {
    return PointError([=](v1::QueryPointRequest* request) {
      v1::AsOf* const as_of = request->mutable_as_of();
      as_of->set_consistency(v1::CONSISTENCY_LINEARIZABLE);
      as_of->set_seen_revision(seen);
      as_of->set_seen_incarnation(incarnation);
    });
  };
  EXPECT_TRUE(error(1).ok());
  const grpc::Status never = error(99);
  EXPECT_EQ(never.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(never.error_message(), HasSubstr("the caller has seen 99"));
}

TEST_F(PastQueryTest, RevisionThatWasSeenDoesNotShortenTheWaitForALaterOne) {
  const uint64_t incarnation = session().incarnation();
  std::future<grpc::Status> answered = std::async(std::launch::async, [&] {
    return PointError([=](v1::QueryPointRequest* request) {
      v1::AsOf* const as_of = request->mutable_as_of();
      as_of->set_min_revision(2);
      as_of->set_seen_revision(2);
      as_of->set_seen_incarnation(incarnation);
    });
  });
  const auto longer = absl::ToChronoMilliseconds(RevisionWait::kSeen * 1.25);
  EXPECT_EQ(answered.wait_for(longer), std::future_status::timeout);
  Edit({Thing(0, 0)});
  const grpc::Status status = answered.get();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(PastQueryTest, ShutdownEndsAWait) {
  std::thread waiting([this] {
    const grpc::Status status = PointError(
        [](v1::QueryPointRequest* request) { request->mutable_as_of()->set_min_revision(100); });
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  });
  const absl::Time begin = absl::Now();
  server_.Shutdown(absl::Seconds(60));
  waiting.join();
  EXPECT_LT(absl::Now() - begin, absl::Seconds(30));
}

}  // namespace
}  // namespace hypermap::server
