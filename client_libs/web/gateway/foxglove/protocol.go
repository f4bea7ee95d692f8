package foxglove

import (
	_ "embed"
	"encoding/binary"
	"encoding/json"
	"time"
)

// The messages of the protocol that the gateway sends and takes:
// https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. Messages without content are JSON text.

// subprotocols are the names under which clients ask for the protocol. The second one is that of Foxglove's SDK
// and newer programs; the messages are the same.
var subprotocols = []string{"foxglove.websocket.v1", "foxglove.sdk.v1"}

// Levels of a status.
const (
	levelWarning = 1
	levelError   = 2
)

type serverInfo struct {
	Op           string   `json:"op"`
	Name         string   `json:"name"`
	Capabilities []string `json:"capabilities"`
	SessionID    string   `json:"sessionId"`
}

type status struct {
	Op      string `json:"op"`
	Level   int    `json:"level"`
	Message string `json:"message"`
	// A status with the same id replaces an earlier one.
	ID string `json:"id,omitempty"`
}

type removeStatus struct {
	Op        string   `json:"op"`
	StatusIDs []string `json:"statusIds"`
}

type advertise struct {
	Op       string              `json:"op"`
	Channels []advertisedChannel `json:"channels"`
}

type advertisedChannel struct {
	ID             uint32 `json:"id"`
	Topic          string `json:"topic"`
	Encoding       string `json:"encoding"`
	SchemaName     string `json:"schemaName"`
	Schema         string `json:"schema"`
	SchemaEncoding string `json:"schemaEncoding"`
}

type unadvertise struct {
	Op         string   `json:"op"`
	ChannelIDs []uint32 `json:"channelIds"`
}

type parameterValues struct {
	Op         string      `json:"op"`
	Parameters []parameter `json:"parameters"`
	ID         string      `json:"id,omitempty"`
}

type parameter struct {
	Name  string `json:"name"`
	Value any    `json:"value,omitempty"`
}

// command is a message of the client. Which fields are set depends on the operation.
type command struct {
	Op              string         `json:"op"`
	Subscriptions   []subscription `json:"subscriptions"`
	SubscriptionIDs []uint32       `json:"subscriptionIds"`
	ParameterNames  []string       `json:"parameterNames"`
	Parameters      []parameter    `json:"parameters"`
	ID              string         `json:"id"`
}

type subscription struct {
	ID        uint32 `json:"id"`
	ChannelID uint32 `json:"channelId"`
}

// Schemas of the content, see client_libs/web/foxglove.
var (
	//go:embed schemas/foxglove.Grid.json
	gridSchema string
	//go:embed schemas/foxglove.SceneUpdate.json
	sceneSchema string
	//go:embed schemas/foxglove.FrameTransforms.json
	transformsSchema string
)

// messageDataOpcode begins a binary message with content.
const messageDataOpcode = 1

// contentHeader returns what precedes the content of a message for a subscription.
func contentHeader(subscription uint32, now time.Time) []byte {
	header := []byte{messageDataOpcode}
	header = binary.LittleEndian.AppendUint32(header, subscription)
	return binary.LittleEndian.AppendUint64(header, uint64(now.UnixNano()))
}

// timestamp is Foxglove's time or duration.
type timestamp struct {
	Sec  int64 `json:"sec"`
	Nsec int   `json:"nsec"`
}

func toTimestamp(t time.Time) timestamp { return timestamp{t.Unix(), t.Nanosecond()} }

func mustMarshal(value any) []byte {
	text, err := json.Marshal(value)
	if err != nil {
		panic(err) // The types of this package can be marshalled.
	}
	return text
}
