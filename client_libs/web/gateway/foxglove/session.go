package foxglove

import (
	"context"
	"crypto/rand"
	"encoding/json"
	"errors"
	"strings"
	"time"

	"github.com/coder/websocket"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// session is a connection of a client. One goroutine runs it, and alone writes to the connection; others read
// the client's commands, follow the map and send pings.
type session struct {
	conn     *websocket.Conn
	caller   *mapserver.Caller
	limits   Limits
	commands chan command
	news     *news

	// The map and its incarnation.
	name        string
	frame       string
	incarnation uint64
	// The newest revision that is known.
	revision int64
	asOf     asOf

	// Whether the list of layers may have changed.
	list     paced
	channels []*channel
	// The id of the next channel; ids are not used again.
	nextChannel   uint32
	subscriptions map[uint32]*channel
	// The parameters whose changes the client wants to know.
	wanted map[string]bool
	// Whether the newest revision is to be told.
	told paced
	// Ids of the problems that the client was told and that last.
	problems map[string]bool
}

func newSession(conn *websocket.Conn, caller *mapserver.Caller, found *pb.Map, limits Limits) *session {
	return &session{
		conn:          conn,
		caller:        caller,
		limits:        limits,
		commands:      make(chan command, maxCommands),
		news:          newNews(),
		name:          found.GetName(),
		frame:         found.GetFrameId(),
		incarnation:   found.GetIncarnation(),
		nextChannel:   1,
		subscriptions: map[uint32]*channel{},
		wanted:        map[string]bool{},
		problems:      map[string]bool{},
	}
}

// errEnded tells that the client has gone.
var errEnded = errors.New("the connection has ended")

// serve serves the client until it leaves, or ctx is done.
func (s *session) serve(ctx context.Context) {
	ctx, stop := context.WithCancel(ctx)
	ended := make(chan struct{})
	go func() {
		defer close(ended)
		(&follower{caller: s.caller, name: s.name, news: s.news}).follow(ctx)
	}()
	go s.readCommands(ctx)
	go s.ping(ctx, stop)

	err := s.run(ctx)
	var told *closing
	if errors.As(err, &told) {
		_ = s.conn.Close(told.code, told.reason)
	}
	stop()
	_ = s.conn.CloseNow()
	<-ended
}

// closing ends a session with a reason for the client.
type closing struct {
	code   websocket.StatusCode
	reason string
}

// newClosing cuts the reason to what the protocol has room for.
func newClosing(code websocket.StatusCode, reason string) *closing {
	const most = 123
	return &closing{code, strings.ToValidUTF8(reason[:min(len(reason), most)], "")}
}

func (c *closing) Error() string { return c.reason }

// run serves until the connection or ctx ends, or the map can't be shown any more.
func (s *session) run(ctx context.Context) error {
	err := s.send(ctx, serverInfo{
		Op:           "serverInfo",
		Name:         "hypermap: " + s.name,
		Capabilities: []string{"parameters", "parametersSubscribe"},
		SessionID:    rand.Text(),
	})
	for err == nil {
		next := time.NewTimer(s.untilDue())
		select {
		case <-ctx.Done():
			err = ctx.Err()
		case asked, open := <-s.commands:
			if !open {
				err = errEnded
			} else {
				err = s.obey(ctx, asked)
			}
		case <-s.news.arrived:
			err = s.note(s.news.take())
		case <-next.C:
			err = s.publishNext(ctx)
		}
		next.Stop()
	}
	return err
}

// readCommands passes on what the client sends. A client that sends faster than it is served waits.
func (s *session) readCommands(ctx context.Context) {
	defer close(s.commands)
	for {
		kind, data, err := s.conn.Read(ctx)
		if err != nil {
			return
		}
		var asked command
		if kind != websocket.MessageText || json.Unmarshal(data, &asked) != nil {
			asked = command{Op: "unreadable"}
		}
		select {
		case s.commands <- asked:
		case <-ctx.Done():
			return
		}
	}
}

// ping ends the session if the client gives no sign of life.
func (s *session) ping(ctx context.Context, stop context.CancelFunc) {
	for {
		select {
		case <-ctx.Done():
			return
		case <-time.After(s.limits.PingAfter):
		}
		alive, cancel := context.WithTimeout(ctx, s.limits.Patience)
		err := s.conn.Ping(alive)
		cancel()
		if err != nil {
			stop()
			return
		}
	}
}

// note marks what is to be sent after changes of the map. The past does not change.
func (s *session) note(c changes) error {
	if c.ended != nil {
		return newClosing(websocket.StatusPolicyViolation, mapserver.Message(c.ended))
	}
	if c.found != nil && c.found.GetIncarnation() != s.incarnation {
		// Revisions mean something else now.
		s.incarnation, s.frame, s.revision, s.asOf = c.found.GetIncarnation(), c.found.GetFrameId(), 0, asOf{}
	}
	if c.revision > s.revision {
		s.revision = c.revision
		s.told.isDue = true
	}
	if s.asOf.isPast() {
		return nil
	}
	s.list.isDue = s.list.isDue || c.all || c.list
	for _, channel := range s.channels {
		if c.all || (channel.layer == nil && c.transforms) || c.layers[channel.layer.GetName()] {
			channel.isDue = true
		}
	}
	return nil
}

// send sends a message without content.
func (s *session) send(ctx context.Context, message any) error {
	text := mustMarshal(message)
	ctx, cancel := context.WithTimeout(ctx, s.limits.TimeFor(int64(len(text))))
	defer cancel()
	return s.conn.Write(ctx, websocket.MessageText, text)
}

// tellProblem tells the client a problem that lasts until solved is called.
func (s *session) tellProblem(ctx context.Context, id string, err error) error {
	s.problems[id] = true
	return s.send(ctx, status{Op: "status", Level: levelError, Message: id + ": " + mapserver.Message(err), ID: id})
}

// solved takes back a problem that the client was told.
func (s *session) solved(ctx context.Context, id string) error {
	if !s.problems[id] {
		return nil
	}
	delete(s.problems, id)
	return s.send(ctx, removeStatus{"removeStatus", []string{id}})
}

// warn tells the client what it did wrong.
func (s *session) warn(ctx context.Context, message string) error {
	return s.send(ctx, status{Op: "status", Level: levelWarning, Message: message})
}
