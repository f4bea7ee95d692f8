// Package foxglove shows maps in Foxglove and Lichtblick, by the protocol of Foxglove's WebSocket.
//
// A connection shows one map. Each layer of cells is a channel of foxglove.Grid, each layer of objects one of
// foxglove.SceneUpdate, and the frame tree one of foxglove.FrameTransforms. A client that subscribes to a channel
// gets its content at once, and again after changes, never more than the newest: what changes while a message is
// sent is in the next one. The gateway keeps no content: it asks the server when it sends.
package foxglove

import (
	"net/http"
	"strings"
	"time"

	"github.com/coder/websocket"

	"hypermap-gateway/mapserver"
)

const (
	// maxCommandBytes bounds a message of a client.
	maxCommandBytes = 64 << 10
	// maxCommands is the number of messages of a client that wait.
	maxCommands = 16
)

// Limits bounds the time that clients may take.
type Limits struct {
	// Time after which a client is asked for a sign of life, and time that it has to answer.
	PingAfter, Patience time.Duration
	// TimeFor returns how long a client may take to read a message of so many bytes.
	TimeFor func(bytes int64) time.Duration
}

// Serve shows the map that the path names as {map} to a client.
func (l Limits) Serve(w http.ResponseWriter, r *http.Request, caller *mapserver.Caller) {
	name := r.PathValue("map")
	found, err := caller.GetMap(r.Context(), name)
	if err != nil {
		mapserver.Refuse(w, err)
		return
	}
	if !asksForProtocol(r) {
		http.Error(w, "this path speaks WebSocket with one of the subprotocols "+strings.Join(subprotocols, ", "),
			http.StatusUpgradeRequired)
		return
	}
	conn, err := websocket.Accept(w, r, &websocket.AcceptOptions{
		Subprotocols: subprotocols,
		// The gateway has checked the origin of all requests.
		InsecureSkipVerify: true,
	})
	if err != nil {
		return // Accept has answered.
	}
	conn.SetReadLimit(maxCommandBytes)
	s := newSession(conn, caller, found, l)
	s.serve(r.Context())
}

// asksForProtocol reports whether the request is for a WebSocket with one of the subprotocols.
func asksForProtocol(r *http.Request) bool {
	if !strings.EqualFold(r.Header.Get("Upgrade"), "websocket") {
		return false
	}
	for _, header := range r.Header.Values("Sec-WebSocket-Protocol") {
		for _, asked := range strings.Split(header, ",") {
			for _, known := range subprotocols {
				if strings.TrimSpace(asked) == known {
					return true
				}
			}
		}
	}
	return false
}
