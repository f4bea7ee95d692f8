// Package history holds the record of one run: what clients asked of a map, what the server answered,
// and when. The recorder makes histories and the model judges them; a file of JSON lines keeps one.
package history

import (
	"reflect"
	"slices"
	"time"
)

// RPC is the name of the rpc that an operation called.
type RPC string

// The rpcs that clients call. ApplyEdits changes the map; the others read it.
const (
	ApplyEdits RPC = "ApplyEdits"
	// QueryPoint reads the objects at one place.
	QueryPoint RPC = "QueryPoint"
	// QueryArea, QueryValue and QueryNearest read all objects.
	QueryArea    RPC = "QueryArea"
	QueryValue   RPC = "QueryValue"
	QueryNearest RPC = "QueryNearest"
	// GetMap reads the newest revision, without objects.
	GetMap RPC = "GetMap"
)

// Status is the gRPC status of an answer. Only statuses that tell the outcome occur in a history:
// after any other the outcome is unknown.
type Status string

// The statuses that tell the outcome.
const (
	OK              Status = "OK"
	Aborted         Status = "ABORTED"
	NotFound        Status = "NOT_FOUND"
	InvalidArgument Status = "INVALID_ARGUMENT"
	OutOfRange      Status = "OUT_OF_RANGE"
)

// Object is an object of the map, reduced to what the model knows of it. Every put carries a value
// that no other put has, so that a read tells which put it saw.
type Object struct {
	ID      int64 `json:"id"`
	Place   int   `json:"place"`
	Version int64 `json:"version"`
	Value   int64 `json:"value"`
}

// Action is what an edit does.
type Action string

// The actions. Create puts an object without an id, so that the server assigns one.
const (
	Create Action = "create"
	Put    Action = "put"
	Delete Action = "delete"
)

// Edit is one edit of a batch.
type Edit struct {
	Action Action `json:"action"`
	ID     int64  `json:"id,omitempty"`
	Place  int    `json:"place,omitempty"`
	Value  int64  `json:"value,omitempty"`
	// IfVersion is the version that the object must have. Nil: any.
	IfVersion *int64 `json:"if_version,omitempty"`
}

// Request is the content of a request. It is not changed once it has been made.
type Request struct {
	RPC RPC `json:"rpc"`

	// Of ApplyEdits. Without an id, a retry could be carried out twice.
	ID    string `json:"request_id,omitempty"`
	Edits []Edit `json:"edits,omitempty"`
	// IfLayer is the version that the layer must have. Nil: any.
	IfLayer *int64 `json:"if_layer,omitempty"`

	// Of QueryPoint.
	Place int `json:"place,omitempty"`
	// Of queries. AtRevision is the past revision to read (nil: the newest), MinRevision the revision
	// to wait for.
	AtRevision  *int64 `json:"at_revision,omitempty"`
	MinRevision int64  `json:"min_revision,omitempty"`
	// Linearizable queries show what any server has acknowledged. A server alone answers all so.
	Linearizable bool `json:"linearizable,omitempty"`
}

// IsRead reports whether the request changes nothing.
func (r *Request) IsRead() bool { return r.RPC != ApplyEdits }

// SameAs reports whether two requests have the same id and content.
func (r *Request) SameAs(other *Request) bool { return r == other || reflect.DeepEqual(r, other) }

// Answer is the server's answer. Only Status is set if it is not OK.
type Answer struct {
	Status      Status `json:"status"`
	Incarnation uint64 `json:"incarnation,omitempty,string"`
	// The revision that the edits made, or that was read.
	Revision int64 `json:"revision,omitempty"`
	// Of ApplyEdits: for each edit the id of the object that it put, otherwise 0.
	ObjectIDs []int64 `json:"object_ids,omitempty"`
	// Of queries: the objects that were found, sorted by id.
	Objects []Object `json:"objects,omitempty"`
}

// Operation is a request with all its attempts, and its answer.
type Operation struct {
	// Client is the sequence of operations to which this one belongs. No two operations of a client
	// overlap: after an unknown outcome, the client goes on under another number.
	Client  int     `json:"client"`
	Request Request `json:"request"`
	// Answer is nil if the outcome is unknown: the request may have been carried out at any time after
	// Call, or never.
	Answer *Answer `json:"answer,omitempty"`
	// Call is the time before the first attempt, Return the time after the last; both count from the
	// beginning of the history. Return means nothing without an answer.
	Call     time.Duration `json:"call_ns"`
	Return   time.Duration `json:"return_ns,omitempty"`
	Attempts int           `json:"attempts"`
	// LastAttempt is the time before the last of several attempts.
	LastAttempt time.Duration `json:"last_attempt_ns,omitempty"`
}

// Event is something that happened to the server, for people who read a history.
type Event struct {
	At   time.Duration `json:"at_ns"`
	What string        `json:"what"`
}

// Change is a change that a watch was told of. Deletions have no value.
type Change struct {
	Kind     string `json:"kind"`
	ObjectID int64  `json:"object_id"`
	Value    int64  `json:"value,omitempty"`
}

// WatchFaults count what watches were told wrongly.
type WatchFaults struct {
	Gaps     int `json:"watch_gaps"`
	Repeats  int `json:"watch_repeats"`
	Reorders int `json:"watch_reorders"`
	// Others are changes that another watch was told otherwise, missing revisions at the end, and errors
	// that a watch must not get.
	Others int `json:"watch_errors"`
}

// Map is the state of the map before the first operation.
type Map struct {
	Incarnation uint64 `json:"incarnation,string"`
	Revision    int64  `json:"revision"`
	// NextID is the id that the server assigns to the next new object.
	NextID  int64    `json:"next_id"`
	Objects []Object `json:"objects"`
}

// History is one run. Operations are sorted by Call.
type History struct {
	Seed    uint64
	Number  int
	Initial Map
	Events  []Event
	Kills   int
	// WriteGaps are the times from each fault to the next write that was acknowledged, by the kind of the
	// fault.
	WriteGaps map[string][]time.Duration
	// Told are the changes of the revisions of which watches were told.
	Told        map[int64][]Change
	WatchFaults WatchFaults
	Operations  []Operation
}

// WasCarriedOutBefore reports whether a retried edit was certainly carried out by an attempt before the
// last, because another operation had seen its revision by then. Its answer is then that of its receipt.
func (h *History) WasCarriedOutBefore(retried *Operation) bool {
	if retried.Attempts < 2 || retried.Answer == nil || retried.Answer.Status != OK {
		return false
	}
	return slices.ContainsFunc(h.Operations, func(other Operation) bool {
		return other.Answer != nil && other.Answer.Status == OK && other.Return < retried.LastAttempt &&
			other.Answer.Revision >= retried.Answer.Revision
	})
}
