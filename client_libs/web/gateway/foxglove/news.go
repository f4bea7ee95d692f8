package foxglove

import (
	"context"
	"sync"
	"time"

	"connectrpc.com/connect"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// retryAfter is the time between a failed call to the server and the next one.
const retryAfter = time.Second

// changes says what of a map has changed.
type changes struct {
	// The newest revision that is known.
	revision int64
	// The map, if it may be another incarnation.
	found *pb.Map
	// Names of the layers whose content changed.
	layers map[string]bool
	// Whether layers came, went or changed otherwise.
	list       bool
	transforms bool
	// Whether all may have changed, as after a break of the connection.
	all bool
	// Why the map can't be followed any more, or nil.
	ended error
}

// news collects changes until the session takes them, so that any number of them takes bounded memory. Safe
// for concurrent use.
type news struct {
	// Has a value when there may be changes.
	arrived chan struct{}

	mu      sync.Mutex
	pending changes
}

func newNews() *news { return &news{arrived: make(chan struct{}, 1)} }

// add lets `note` note changes.
func (n *news) add(note func(*changes)) {
	n.mu.Lock()
	if n.pending.layers == nil {
		n.pending.layers = map[string]bool{}
	}
	note(&n.pending)
	n.mu.Unlock()
	select {
	case n.arrived <- struct{}{}:
	default:
	}
}

// take returns the changes since the last call.
func (n *news) take() changes {
	n.mu.Lock()
	defer n.mu.Unlock()
	taken := n.pending
	n.pending = changes{}
	return taken
}

// follower notes the changes of a map.
type follower struct {
	caller *mapserver.Caller
	name   string
	news   *news
	// What has been noted: changes up to a revision of an incarnation.
	revision    int64
	incarnation uint64
}

// follow notes changes until ctx is done or the caller may no longer see the map.
func (f *follower) follow(ctx context.Context) {
	for ctx.Err() == nil {
		err := f.followOnce(ctx)
		if mapserver.IsCode(err, connect.CodeNotFound, connect.CodeUnauthenticated, connect.CodePermissionDenied) {
			f.news.add(func(c *changes) { c.ended = err })
			return
		}
		select {
		case <-ctx.Done():
		case <-time.After(retryAfter):
		}
	}
}

// followOnce notes what a watch reports until the watch ends. What happened since the last watch may be anything.
func (f *follower) followOnce(ctx context.Context) error {
	found, err := f.caller.GetMap(ctx, f.name)
	if err != nil {
		return err
	}
	if found.GetIncarnation() != f.incarnation || found.GetRevision() != f.revision {
		f.revision, f.incarnation = found.GetRevision(), found.GetIncarnation()
		f.news.add(func(c *changes) { c.all, c.found, c.revision = true, found, found.GetRevision() })
	}
	scope := &pb.Scope{Map: f.name, Incarnation: f.incarnation}
	return f.caller.Watch(ctx, scope, f.revision, func(message *pb.WatchResponse) {
		f.news.add(func(c *changes) { c.note(message) })
		f.revision = lastRevision(message, f.revision)
	})
}

// lastRevision returns the newest revision of which a message tells the rest, or `before` if there is none.
func lastRevision(message *pb.WatchResponse, before int64) int64 {
	for _, part := range message.GetCoalesced() {
		before = lastRevision(part, before)
	}
	if len(message.GetCoalesced()) > 0 || message.GetMore() {
		return before
	}
	return message.GetRevision()
}

// note notes what a message of a watch reports. Its content is not kept: the session asks for the newest.
func (c *changes) note(message *pb.WatchResponse) {
	for _, part := range message.GetCoalesced() {
		c.note(part)
	}
	c.revision = max(c.revision, message.GetRevision())
	// A frame was moved, and with it what lies in it.
	c.all = c.all || message.GetReset_()
	for _, change := range message.GetChanges() {
		switch change.GetKind() {
		case pb.ChangeKind_CHANGE_KIND_TRANSFORM:
			c.transforms = true
		case pb.ChangeKind_CHANGE_KIND_LAYER_CREATED, pb.ChangeKind_CHANGE_KIND_LAYER_DELETED,
			pb.ChangeKind_CHANGE_KIND_LAYER_CHANGED:
			c.list = true
			c.layers[change.GetLayer()] = true
		default:
			c.layers[change.GetLayer()] = true
		}
	}
}
