// Settings by which the kernel shares the processors among the threads of a process.
#ifndef HYPERMAP_SERVER_RPC_SCHEDULING_H_
#define HYPERMAP_SERVER_RPC_SCHEDULING_H_

namespace hypermap::server {

// For a thread that computes for long: raises its niceness (nice(7)) to at least this one (0 leaves
// it as it is, also if the server was started with less), and asks for time slices of 0.1 ms. A
// thread that wakes up may then take the processor from it once it has used up its slice, instead
// of waiting for the next tick of the kernel's timer, which comes every 4 ms on many systems; and
// the calling thread gives up no more than a slice when it yields. Its share of the processors
// stays that of its niceness. Linux can do this since 6.12 (sched_attr(2), EEVDF); earlier kernels
// set only the niceness.
void ScheduleLongWork(int niceness);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SCHEDULING_H_
