# Tells ThreadSanitizer of the order that gRPC's callback API gives.
#
# Debian's gRPC is not instrumented, but templates in its headers are compiled into our programs. So
# ThreadSanitizer sees what both of two threads do, and not that gRPC runs one after the other. This
# file adds that order to copies of the headers, which all targets then use:
#
#   - who starts a batch of operations comes before the callback at its end;
#   - all callbacks of a call come before its OnDone, which may run on another thread;
#   - who starts a call comes before its OnCancel, and that before its OnDone; OnCancel begins with a
#     CancelScope (base/sync/cancel_scope.h);
#   - all callbacks of a client's reactor come before its OnDone, which then begins with one, too;
#   - operations that a reactor starts before gRPC has bound it to its call come before the binding;
#   - the methods of a synchronous service, and OnDone of the calls of others, come before the end of
#     their server's Shutdown.
set(HYPERMAP_TSAN_INCLUDE ${CMAKE_BINARY_DIR}/grpc_for_tsan)

set(tsan_prelude [[
#ifndef GRPC_FOR_TSAN
#define GRPC_FOR_TSAN
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
// The ends of all calls: of the method of a synchronous service, or of OnDone. One order for all
// servers: Shutdown alone asks for it, so that it hides nothing from a server that runs.
inline char ends_of_calls;
struct SynchronousMethod {
  ~SynchronousMethod() { __tsan_release(&ends_of_calls); }
};
// A lock whose order is seen, although its mutex is not instrumented.
template <typename MutexLock>
class OrderedLock {
 public:
  template <typename Mutex>
  explicit OrderedLock(Mutex* mutex) : lock_(mutex), mutex_(mutex) { __tsan_acquire(mutex_); }
  ~OrderedLock() { __tsan_release(mutex_); }

 private:
  MutexLock lock_;
  void* mutex_;
};
#endif
]])

# Copies a header, with pairs of a regular expression and its replacement applied.
function(copy_header header)
  find_path(grpc_include ${header} NO_CACHE REQUIRED)
  file(READ ${grpc_include}/${header} text)
  while(ARGN)
    list(POP_FRONT ARGN place replacement)
    string(REGEX REPLACE "${place}" "${replacement}" changed "${text}")
    if(changed STREQUAL text)
      message(FATAL_ERROR "${header} has no \"${place}\": it is not the version that is known here")
    endif()
    set(text "${changed}")
  endwhile()
  string(PREPEND text "${tsan_prelude}")
  # Only if it differs, so that nothing is compiled again.
  set(copy ${HYPERMAP_TSAN_INCLUDE}/${header})
  if(EXISTS ${copy})
    file(READ ${copy} before)
  endif()
  if(NOT text STREQUAL before)
    file(WRITE ${copy} "${text}")
  endif()
endfunction()

# Without semicolons, which separate the elements of CMake's lists.
copy_header(grpcpp/impl/call_op_set.h
  "(g_core_codegen_interface)->grpc_call_start_batch\\(\n +call_"
  "(__tsan_release(core_cq_tag()), \\1)->grpc_call_start_batch(call_")
copy_header(grpcpp/support/callback_common.h
  "(static_cast<Callback[A-Za-z]+Tag\\*>\\(cb\\))->Run" "(__tsan_acquire(cb), \\1)->Run")
copy_header(grpcpp/support/server_callback.h
  "return (callbacks_outstanding_|on_cancel_conditions_remaining_)\\.fetch_sub"
  "return __tsan_release(this), \\1.fetch_sub"
  "if \\(GPR_UNLIKELY\\(UnblockCancellation\\(\\)\\)\\) {\n +CallOnCancel\\(reactor\\)"
  "if (__tsan_release(reactor), UnblockCancellation()) { CallOnCancel(reactor)"
  "grpc::internal::MutexLock l\\(" "OrderedLock<grpc::internal::MutexLock> l(")
copy_header(grpcpp/impl/codegen/server_callback_handlers.h
  "BeginCompletionOp\\(\n +param\\.call,[ \n]+\\[(call|reader|writer|stream)\\]\\(bool\\) {"
  "BeginCompletionOp((__tsan_release(static_cast<ServerCallbackCall*>(\\1)), param.call), [\\1](bool) {"
  "(call|reader|writer|stream)->MaybeDone\\("
  "(__tsan_acquire(static_cast<ServerCallbackCall*>(\\1)), \\1)->MaybeDone("
  "return reactor_"
  "return __tsan_acquire(static_cast<ServerCallbackCall*>(this)), reactor_"
  "(reactor_\\.load\\(std::memory_order_relaxed\\))->OnDone\\(\\)"
  "(__tsan_acquire(static_cast<ServerCallbackCall*>(this)), __tsan_acquire(\\1), \\1)->OnDone(),
      __tsan_release(&ends_of_calls)")
copy_header(grpcpp/support/client_callback.h
  "reactor->InternalScheduleOnDone\\(" "__tsan_release(reactor), reactor->InternalScheduleOnDone(")
copy_header(grpcpp/support/method_handler.h
  "return handler\\(\\)" "return SynchronousMethod(), handler()")
copy_header(grpcpp/impl/codegen/server_interface.h
  "(ShutdownInternal\\(TimePoint<T>\\(deadline\\)\\.raw_time\\(\\)\\))"
  "(\\1, __tsan_acquire(&ends_of_calls))"
  "(ShutdownInternal\\(\n[^\n]+gpr_inf_future\\(GPR_CLOCK_MONOTONIC\\)\\))"
  "(\\1, __tsan_acquire(&ends_of_calls))")
include_directories(BEFORE SYSTEM ${HYPERMAP_TSAN_INCLUDE})
