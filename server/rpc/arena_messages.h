// Messages of unary calls on an arena each.
#ifndef HYPERMAP_SERVER_RPC_ARENA_MESSAGES_H_
#define HYPERMAP_SERVER_RPC_ARENA_MESSAGES_H_

#include <google/protobuf/arena.h>
#include <grpcpp/support/message_allocator.h>

#include <cstddef>

namespace hypermap::server {

// An answer is many small messages; on an arena they cost a step of a pointer each, and nothing to
// free. Arenas begin in a block of `kBytes`, which holds the ordinary request and answer.
template <typename Request, typename Response, size_t kBytes = 2048>
class ArenaMessages final : public grpc::MessageAllocator<Request, Response> {
 public:
  grpc::MessageHolder<Request, Response>* AllocateMessages() override { return new Holder(); }

 private:
  class Holder final : public grpc::MessageHolder<Request, Response> {
   public:
    Holder() : arena_(block_, sizeof block_) {
      this->set_request(google::protobuf::Arena::CreateMessage<Request>(&arena_));
      this->set_response(google::protobuf::Arena::CreateMessage<Response>(&arena_));
    }
    void Release() override { delete this; }

   private:
    alignas(std::max_align_t) char block_[kBytes];
    google::protobuf::Arena arena_;
  };
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_ARENA_MESSAGES_H_
