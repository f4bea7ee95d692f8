package model

import (
	"testing"
	"time"

	"hypermap-linearizability/history"
)

// Histories are written by hand as calls of `sequel` and `span`. The map begins at revision 1 with the
// objects #1 at place 1 and #2 at place 2, both of version 1 and value 0.

const incarnation = 77

func initialMap() history.Map {
	return history.Map{Incarnation: incarnation, Revision: 1, NextID: 3, Objects: []history.Object{
		{ID: 1, Place: 1, Version: 1}, {ID: 2, Place: 2, Version: 1}}}
}

// done is a request with its answer. The answer is nil if the outcome is unknown.
type done struct {
	request history.Request
	answer  *history.Answer
}

// span is an operation between two times.
func span(call, returned time.Duration, d done) history.Operation {
	return history.Operation{Client: int(call), Call: call, Return: returned, Request: d.request, Answer: d.answer, Attempts: 1}
}

// sequel is a history of operations one after another: the first from 0 to 5, the next from 10 to 15 and so on.
func sequel(all ...done) []history.Operation {
	var operations []history.Operation
	for i, d := range all {
		call := time.Duration(10 * i)
		operations = append(operations, span(call, call+5, d))
	}
	return operations
}

func expect(t *testing.T, want Verdict, operations []history.Operation) {
	t.Helper()
	h := &history.History{Initial: initialMap(), Operations: operations}
	if got := Judge(h, time.Minute); got != want {
		t.Errorf("got verdict %d, want %d", got, want)
	}
	if got := judgeWithoutCuts(h); got != want {
		t.Errorf("without cuts: got verdict %d, want %d", got, want)
	}
}

func ref(number int64) *int64 { return &number }

func put(id, value int64) history.Edit {
	return history.Edit{Action: history.Put, ID: id, Place: int(id), Value: value}
}

func putIf(id, value, version int64) history.Edit {
	edit := put(id, value)
	edit.IfVersion = ref(version)
	return edit
}

func create(place int, value int64) history.Edit {
	return history.Edit{Action: history.Create, Place: place, Value: value}
}

func remove(id int64) history.Edit { return history.Edit{Action: history.Delete, ID: id} }

func edits(id string, edits ...history.Edit) history.Request {
	return history.Request{RPC: history.ApplyEdits, ID: id, Edits: edits}
}

// made is an acknowledged request. The ids of the objects are those of the edits.
func made(revision int64, request history.Request) done {
	ids := make([]int64, len(request.Edits))
	for i, edit := range request.Edits {
		if edit.Action == history.Put {
			ids[i] = edit.ID
		}
	}
	return madeWithIDs(revision, request, ids...)
}

func madeWithIDs(revision int64, request history.Request, ids ...int64) done {
	return done{request, &history.Answer{Status: history.OK, Incarnation: incarnation, Revision: revision, ObjectIDs: ids}}
}

func refused(status history.Status, request history.Request) done {
	return done{request, &history.Answer{Status: status}}
}

func unknown(request history.Request) done { return done{request, nil} }

// saw is a read that was answered with a revision and objects.
func saw(request history.Request, revision int64, objects ...history.Object) done {
	return done{request, &history.Answer{Status: history.OK, Incarnation: incarnation, Revision: revision, Objects: objects}}
}

func all() history.Request { return history.Request{RPC: history.QueryArea} }

func atPlace(place int) history.Request {
	return history.Request{RPC: history.QueryPoint, Place: place}
}

func newest() history.Request { return history.Request{RPC: history.GetMap} }

func past(revision int64) history.Request {
	return history.Request{RPC: history.QueryArea, AtRevision: ref(revision)}
}

func thing(id, version, value int64) history.Object {
	return history.Object{ID: id, Place: int(id), Version: version, Value: value}
}
