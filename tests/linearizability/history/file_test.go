package history

import (
	"bytes"
	"reflect"
	"testing"
	"time"
)

func TestAHistoryIsReadAsItWasWritten(t *testing.T) {
	version := int64(7)
	written := &History{
		Seed: 11, Number: 3, Kills: 1,
		Initial:   Map{Incarnation: 1<<64 - 1, Revision: 2, NextID: 3, Objects: []Object{{ID: 1, Version: 2, Value: 5}}},
		Events:    []Event{{At: time.Millisecond, What: "killed"}},
		WriteGaps: map[string][]time.Duration{"kill": {3 * time.Second}},
		Told:      map[int64][]Change{5: {{Kind: "put", ObjectID: 1, Value: 3}}}, WatchFaults: WatchFaults{Gaps: 1},
		Operations: []Operation{
			{Client: 1, Call: 1, Return: 9, Attempts: 2, LastAttempt: 6,
				Request: Request{RPC: ApplyEdits, ID: "r1", IfLayer: &version, Edits: []Edit{
					{Action: Put, ID: 1, Place: 2, Value: 6, IfVersion: &version}, {Action: Delete, ID: 1}}},
				Answer: &Answer{Status: OK, Incarnation: 1<<64 - 1, Revision: 3, ObjectIDs: []int64{1, 0}}},
			{Client: 2, Call: 4, Attempts: 1, Request: Request{RPC: ApplyEdits, Edits: []Edit{{Action: Create, Value: 8}}}},
			{Client: 3, Call: 5, Return: 8, Attempts: 1,
				Request: Request{RPC: QueryPoint, Place: 1, AtRevision: &version, MinRevision: 2},
				Answer:  &Answer{Status: OutOfRange}},
		},
	}
	var file bytes.Buffer
	if err := written.Write(&file); err != nil {
		t.Fatal(err)
	}
	read, err := Read(&file)
	if err != nil {
		t.Fatal(err)
	}
	if !reflect.DeepEqual(read, written) {
		t.Errorf("got %+v, want %+v", read, written)
	}
}

func TestAFileThatIsCutOffIsAnError(t *testing.T) {
	for _, text := range []string{"", `{"seed":1`, `{"seed":1}` + "\n" + `{"client":`} {
		if _, err := Read(bytes.NewBufferString(text)); err == nil {
			t.Errorf("%q was read", text)
		}
	}
}

func TestARetriedEditWasCarriedOutBeforeIfItsRevisionHadBeenSeen(t *testing.T) {
	seen := Operation{Call: 10, Return: 20, Request: Request{RPC: GetMap}, Answer: &Answer{Status: OK, Revision: 5}}
	retried := Operation{Call: 0, LastAttempt: 30, Return: 40, Attempts: 2, Answer: &Answer{Status: OK, Revision: 5}}
	later := retried
	later.Answer = &Answer{Status: OK, Revision: 6}
	early := retried
	early.LastAttempt = 15
	h := &History{Operations: []Operation{seen}}
	for i, want := range []bool{true, false, false} {
		operation := []Operation{retried, later, early}[i]
		if got := h.WasCarriedOutBefore(&operation); got != want {
			t.Errorf("operation %d: got %v, want %v", i, got, want)
		}
	}
}
