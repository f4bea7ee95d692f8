// How the kernel shares the processors among the threads of a process.
#ifndef HYPERMAP_SERVER_RPC_SCHEDULING_H_
#define HYPERMAP_SERVER_RPC_SCHEDULING_H_

namespace hypermap::server {

// Asks for short time slices for the calling thread and the threads that it starts from now on. A
// thread that wakes up may then take the processor from a thread that has used up its slice,
// instead of waiting for the next tick of the kernel's timer, which comes every 4 ms on many
// systems. The thread's share of the processors stays the same. Linux can do this since 6.12
// (sched_attr(2), EEVDF); earlier kernels ignore it.
void RequestShortSlices();

// Raises the calling thread's niceness (nice(7)) to at least this one. It keeps its short slices,
// so that a thread that yields while it computes for long gives up no more than a slice.
void LowerPriority(int niceness);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_SCHEDULING_H_
