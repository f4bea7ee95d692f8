package recorder

import (
	"cmp"
	"slices"
	"sync"
	"sync/atomic"
	"time"

	"hypermap-linearizability/history"
)

// recording collects the operations of all clients while they run.
type recording struct {
	start time.Time
	// The number of operations that have begun, and the number with which the clients end.
	begun   atomic.Int64
	limit   int64
	stopped atomic.Bool
	// Channels that are closed when the operation of this number begins.
	marks map[int64]chan struct{}
	// The number of the next client.
	clients atomic.Int64

	mutex      sync.Mutex
	operations []history.Operation
	events     []history.Event
}

func newRecording(limit int) *recording {
	return &recording{start: time.Now(), limit: int64(limit), marks: map[int64]chan struct{}{}}
}

// mark returns a channel that is closed when an operation begins, the first of which is 1. It is
// called before the clients begin.
func (r *recording) mark(operation int64) <-chan struct{} {
	if r.marks[operation] == nil {
		r.marks[operation] = make(chan struct{})
	}
	return r.marks[operation]
}

// now returns the time since the beginning of the history, by the monotonic clock.
func (r *recording) now() time.Duration { return time.Since(r.start) }

// take takes one of the operations that are left, and returns false if there is none.
func (r *recording) take() bool {
	number := r.begun.Add(1)
	if mark, ok := r.marks[number]; ok {
		close(mark)
	}
	return number <= r.limit && !r.stopped.Load()
}

// stop lets the clients end before the limit.
func (r *recording) stop() { r.stopped.Store(true) }

// newClient returns the number of a client that has no operations yet.
func (r *recording) newClient() int { return int(r.clients.Add(1)) - 1 }

func (r *recording) add(operation history.Operation) {
	r.mutex.Lock()
	defer r.mutex.Unlock()
	r.operations = append(r.operations, operation)
}

func (r *recording) addEvent(what string) {
	at := r.now()
	r.mutex.Lock()
	defer r.mutex.Unlock()
	r.events = append(r.events, history.Event{At: at, What: what})
}

// sorted returns the operations by the times of their calls.
func (r *recording) sorted() []history.Operation {
	r.mutex.Lock()
	defer r.mutex.Unlock()
	slices.SortStableFunc(r.operations, func(a, b history.Operation) int { return cmp.Compare(a.Call, b.Call) })
	return r.operations
}
