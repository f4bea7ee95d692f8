package model

import (
	"testing"
	"time"

	"hypermap-linearizability/history"
)

// acknowledgedPut is an acknowledged put of a value.
func acknowledgedPut(id, value, revision int64) history.Operation {
	return history.Operation{
		Request: history.Request{RPC: history.ApplyEdits, Edits: []history.Edit{{Action: history.Put, ID: id, Value: value}}},
		Answer:  &history.Answer{Status: history.OK, Revision: revision, ObjectIDs: []int64{id}},
	}
}

func TestAnAcknowledgedEditThatNoRevisionHasIsLost(t *testing.T) {
	h := &history.History{
		Operations: []history.Operation{acknowledgedPut(1, 10, 2), acknowledgedPut(1, 11, 3), acknowledgedPut(1, 12, 4)},
		Told:       map[int64][]history.Change{2: {{ObjectID: 1, Value: 10}}, 3: {{ObjectID: 1, Value: 99}}, 4: {{ObjectID: 1, Value: 12}}},
	}
	if got, want := Examine(h), (Audit{EditsLost: 1}); got != want {
		t.Errorf("got %+v, want %+v", got, want)
	}
}

func TestAPutThatItsBatchReplacesIsNotLost(t *testing.T) {
	batch := acknowledgedPut(1, 10, 2)
	batch.Request.Edits = append(batch.Request.Edits, history.Edit{Action: history.Delete, ID: 1})
	h := &history.History{Operations: []history.Operation{batch}, Told: map[int64][]history.Change{2: {{ObjectID: 1}}}}
	if got := Examine(h); got != (Audit{}) {
		t.Errorf("got %+v", got)
	}
}

func TestAValueInTwoRevisionsWasCarriedOutTwice(t *testing.T) {
	h := &history.History{
		Operations: []history.Operation{acknowledgedPut(1, 10, 2)},
		Told:       map[int64][]history.Change{2: {{ObjectID: 1, Value: 10}}, 3: {{ObjectID: 2, Value: 10}}},
	}
	if got, want := Examine(h), (Audit{EditsTwice: 1}); got != want {
		t.Errorf("got %+v, want %+v", got, want)
	}
}

func TestAnAnswerOlderThanOneBeforeItsCallIsStale(t *testing.T) {
	acknowledged := acknowledgedPut(1, 10, 5)
	acknowledged.Call, acknowledged.Return = 0, 10
	read := func(call, revision int64) history.Operation {
		o := history.Operation{Request: history.Request{RPC: history.QueryArea}, Answer: &history.Answer{Status: history.OK, Revision: revision}}
		o.Call, o.Return = time.Duration(call), time.Duration(call+5)
		return o
	}
	past := read(20, 3)
	past.Request.AtRevision = &past.Answer.Revision
	h := &history.History{Operations: []history.Operation{acknowledged, read(9, 4), read(11, 5), read(12, 4), past}}
	if got, want := Examine(h), (Audit{StaleReads: 1}); got != want {
		t.Errorf("got %+v, want %+v", got, want)
	}
}
