#include "client_libs/ros2/dds/testing/fast_client.h"

#include <fastdds/rtps/common/WriteParams.h>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/sync/steady_time.h"

namespace hypermap::ros2 {

using ::eprosima::fastdds::dds::PublicationMatchedStatus;
using ::eprosima::fastdds::dds::SampleInfo;
using ::eprosima::fastrtps::rtps::SampleIdentity;
using ::eprosima::fastrtps::rtps::WriteParams;
using ::eprosima::fastrtps::types::ReturnCode_t;

constexpr int kDepth = 10;

FastClient::FastClient(const DdsOptions& options, const std::string& service,
                       const std::string& type)
    : node_(*Node::Make(options)) {
  replies_ = *node_->AddReader(absl::StrCat("rr", service, "Reply"),
                               absl::StrCat(type, "Response_"), TopicQos::kReliable, kDepth, this);
  requests_ =
      *node_->AddWriter(absl::StrCat("rq", service, "Request"), absl::StrCat(type, "Request_"),
                        TopicQos::kReliable, kDepth, nullptr);
}

FastClient::~FastClient() {
  node_->Remove(requests_);
  node_->Remove(replies_);
}

bool FastClient::AwaitService(absl::Duration timeout) {
  const SteadyTime deadline = SteadyTime::Now() + timeout;
  PublicationMatchedStatus status;
  do {
    requests_->get_publication_matched_status(status);
    if (status.current_count > 0) return true;
    absl::SleepFor(absl::Milliseconds(1));
  } while (SteadyTime::Now() < deadline);
  return false;
}

std::optional<std::string> FastClient::Call(std::string request, absl::Duration timeout) {
  WriteParams params;
  params.related_sample_identity().writer_guid(replies_->guid());
  if (!requests_->write(&request, params)) return std::nullopt;
  const int64_t number = params.sample_identity().sequence_number().to64long();
  const SteadyTime deadline = SteadyTime::Now() + timeout;
  const MutexLock lock(&mutex_);
  while (!replied_.contains(number) && SteadyTime::Now() < deadline) {
    changed_.WaitFor(&mutex_, absl::Milliseconds(100));
  }
  auto reply = replied_.extract(number);
  if (reply.empty()) return std::nullopt;
  return std::move(reply.mapped());
}

void FastClient::on_data_available(DataReader* reader) {
  std::string message;
  SampleInfo info;
  while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
    if (!info.valid_data) continue;
    if (info.related_sample_identity == SampleIdentity::unknown()) all_named_calls_ = false;
    if (info.related_sample_identity.writer_guid() != reader->guid()) continue;
    const MutexLock lock(&mutex_);
    replied_.emplace(info.related_sample_identity.sequence_number().to64long(), message);
    changed_.NotifyAll();
  }
}

}  // namespace hypermap::ros2
