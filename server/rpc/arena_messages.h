// Allocates the messages of unary calls on arenas.
#ifndef HYPERMAP_SERVER_RPC_ARENA_MESSAGES_H_
#define HYPERMAP_SERVER_RPC_ARENA_MESSAGES_H_

#include <google/protobuf/arena.h>
#include <grpcpp/support/message_allocator.h>

#include <cstddef>

namespace hypermap::server {

// Gives each call an arena for its request and response. An answer consists of many small messages;
// on an arena, allocating one moves a pointer, and freeing costs nothing. The arena begins with a
// block of `kBytes`, which is enough for the usual request and answer.
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
