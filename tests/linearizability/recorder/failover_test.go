package recorder

import (
	"reflect"
	"testing"
	"time"

	"hypermap-linearizability/history"
)

func TestAWriteGapEndsWithAWriteThatBeganAfterTheFault(t *testing.T) {
	acknowledged := &history.Answer{Status: history.OK}
	write := history.Request{RPC: history.ApplyEdits}
	operations := []history.Operation{
		{Call: 5, Return: 11, Request: write, Answer: acknowledged}, // was under way
		{Call: 10, Return: 12, Request: history.Request{RPC: history.QueryArea}, Answer: acknowledged},
		{Call: 10, Return: 13, Request: write, Answer: &history.Answer{Status: history.Aborted}},
		{Call: 10, Request: write},
		{Call: 5, LastAttempt: 20, Return: 24, Request: write, Answer: acknowledged},
		{Call: 40, Return: 41, Request: write, Answer: acknowledged},
	}
	want := map[string][]time.Duration{"kill": {14}, "pause": {11}}
	if got := writeGaps([]faultTime{{Kill, 10}, {Pause, 30}}, operations); !reflect.DeepEqual(got, want) {
		t.Errorf("got %v, want %v", got, want)
	}
}
