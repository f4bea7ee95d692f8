package recorder

import (
	"cmp"
	"context"
	"errors"
	"fmt"
	"math/rand/v2"
	"slices"
	"sync"
	"time"

	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/status"
	"google.golang.org/protobuf/types/dynamicpb"

	"hypermap-linearizability/history"
)

const (
	// A watcher goes on with another server after at most this time.
	maxWatchTime = 2 * time.Second
	// All revisions have arrived by this time after the last one.
	watchDeadline = 60 * time.Second
)

// watched is what all watchers were told of each revision, which must be the same.
type watched struct {
	mutex     sync.Mutex
	revisions map[int64][]history.Change
	faults    history.WatchFaults
}

// learn returns an error if the revision was told otherwise before.
func (w *watched) learn(revision int64, changes []history.Change) error {
	w.mutex.Lock()
	defer w.mutex.Unlock()
	if before, ok := w.revisions[revision]; ok && !slices.Equal(before, changes) {
		return fmt.Errorf("revision %d has the changes %v, and had %v for another watch", revision, changes, before)
	}
	w.revisions[revision] = changes
	return nil
}

// count counts the error with which a watcher has ended.
func (w *watched) count(err error) {
	w.mutex.Lock()
	defer w.mutex.Unlock()
	var wrong *wrongRevision
	switch {
	case !errors.As(err, &wrong):
		w.faults.Others++
	case wrong.came > wrong.after:
		w.faults.Gaps++
	case wrong.came == wrong.after:
		w.faults.Repeats++
	default:
		w.faults.Reorders++
	}
}

// wrongRevision is a revision that is not the one after the last.
type wrongRevision struct{ after, came int64 }

func (w *wrongRevision) Error() string {
	return fmt.Sprintf("revision %d came after %d", w.came, w.after)
}

// watcher watches a map by one server after another, and checks that each revision comes once, in order,
// and without a gap.
type watcher struct {
	name     string
	fleet    *fleet
	schema   *schema
	random   *rand.Rand
	watched  *watched
	revision int64 // the last one that was told completely
	pending  []history.Change
	// until is the revision with which the watcher ends, once it is known.
	until func() (int64, bool)
}

// run watches until the last revision has come.
func (w *watcher) run(ctx context.Context) error {
	connections, err := w.fleet.connectAll(w.schema)
	if err != nil {
		return err
	}
	defer closeAll(connections)
	var ends time.Time
	for ctx.Err() == nil {
		last, isKnown := w.until()
		if isKnown && w.revision >= last {
			return nil
		}
		if isKnown && ends.IsZero() {
			ends = time.Now().Add(watchDeadline)
		}
		if isKnown && time.Now().After(ends) {
			return fmt.Errorf("watcher %s: revision %d has not come, only %d", w.name, last, w.revision)
		}
		server := w.fleet.anyUp(w.random)
		if err := w.watch(ctx, connections[server]); err != nil {
			return fmt.Errorf("watcher %s, after revision %d by server %s: %w", w.name, w.revision, w.fleet.id(server), err)
		}
		if err := pause(ctx, randomTime(w.random, spread.pause)); err != nil {
			return nil // The run has ended, and tells why.
		}
	}
	return nil
}

// watch resumes the watch by one server, for a while.
func (w *watcher) watch(ctx context.Context, by *connection) error {
	ctx, cancel := context.WithTimeout(ctx, randomTime(w.random, maxWatchTime))
	defer cancel()
	w.pending = nil
	request := object{"scope": object{"map": mapName}, "startRevision": w.revision}
	err := by.call(ctx, "WatchService.Watch", request, func(message *dynamicpb.Message) error {
		var told watchAnswer
		if err := decode(message, &told); err != nil {
			return err
		}
		return w.take(&told)
	})
	switch status.Code(err) {
	case codes.OK, codes.Unavailable, codes.DeadlineExceeded, codes.Canceled:
		return nil
	}
	return err
}

// take takes up a message.
func (w *watcher) take(told *watchAnswer) error {
	switch {
	case told.Snapshot || told.Reset:
		return errors.New("a snapshot came although the watch was resumed")
	case len(told.Changes) == 0 && !told.More && told.Revision == w.revision:
		return nil // Nothing is new.
	case told.Revision != w.revision+1:
		return &wrongRevision{w.revision, told.Revision}
	}
	for _, change := range told.Changes {
		w.pending = append(w.pending, history.Change{Kind: change.Kind, ObjectID: change.ObjectID, Value: change.Object.Attributes.Value.IntValue})
	}
	if told.More {
		return nil
	}
	slices.SortFunc(w.pending, func(a, b history.Change) int {
		return cmp.Or(cmp.Compare(a.ObjectID, b.ObjectID), cmp.Compare(a.Kind, b.Kind), cmp.Compare(a.Value, b.Value))
	})
	if err := w.watched.learn(told.Revision, w.pending); err != nil {
		return err
	}
	w.revision, w.pending = told.Revision, nil
	return nil
}

// watchAnswer is a message of Watch.
type watchAnswer struct {
	Revision int64 `json:"revision,string"`
	Changes  []struct {
		Kind     string       `json:"kind"`
		ObjectID int64        `json:"objectId,string"`
		Object   objectAnswer `json:"object"`
	} `json:"changes"`
	More     bool `json:"more"`
	Snapshot bool `json:"snapshot"`
	Reset    bool `json:"reset"`
}

// watchers are several that run beside the clients.
type watchers struct {
	watched
	group    sync.WaitGroup
	endMutex sync.Mutex
	last     int64
}

// startWatchers starts watchers that have the map as it was at the beginning. One that is told something
// wrong ends.
func (r *run) startWatchers(ctx context.Context, f *fleet, initial history.Map) *watchers {
	all := &watchers{watched: watched{revisions: map[int64][]history.Change{}}}
	for i := range r.options.Watchers {
		w := &watcher{
			name: fmt.Sprint(i + 1), fleet: f, schema: r.schema, random: r.random(1000 + i), watched: &all.watched,
			revision: initial.Revision, until: all.end,
		}
		all.group.Add(1)
		go func() {
			defer all.group.Done()
			if err := w.run(ctx); err != nil {
				r.recording.addEvent(err.Error())
				all.count(err)
			}
		}()
	}
	return all
}

func (w *watchers) end() (int64, bool) {
	w.endMutex.Lock()
	defer w.endMutex.Unlock()
	return w.last, w.last > 0
}

// await returns when all watchers have ended, with this revision.
func (w *watchers) await(last int64) {
	w.endMutex.Lock()
	w.last = last
	w.endMutex.Unlock()
	w.group.Wait()
}
