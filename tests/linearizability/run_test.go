package main

import (
	"context"
	"os"
	"path/filepath"
	"testing"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/model"
)

// writeHistory stores a history in which a read, after a put was acknowledged, names a revision. The
// put made revision 2.
func writeHistory(t *testing.T, seen int64) string {
	t.Helper()
	put := history.Request{RPC: history.ApplyEdits, Edits: []history.Edit{{Action: history.Put, ID: 1, Value: 5}}}
	h := &history.History{
		Seed: 7, Number: 3,
		Initial: history.Map{Revision: 1, NextID: 2, Objects: []history.Object{{ID: 1, Version: 1}}},
		Operations: []history.Operation{
			{Client: 1, Call: 0, Return: 5, Request: put, Answer: &history.Answer{Status: history.OK, Revision: 2, ObjectIDs: []int64{1}}},
			{Client: 2, Call: 10, Return: 15, Request: history.Request{RPC: history.GetMap}, Answer: &history.Answer{Status: history.OK, Revision: seen}},
		},
	}
	path := filepath.Join(t.TempDir(), "history.jsonl")
	if err := h.WriteFile(path); err != nil {
		t.Fatal(err)
	}
	return path
}

func TestReplayOfALinearizableHistoryHolds(t *testing.T) {
	cfg := config{replay: writeHistory(t, 2), timeout: time.Minute, artifacts: t.TempDir()}
	if holds, err := run(context.Background(), cfg); !holds || err != nil {
		t.Errorf("got %v, %v", holds, err)
	}
}

func TestReplayOfAViolationStoresItAndItsVisualization(t *testing.T) {
	cfg := config{replay: writeHistory(t, 1), timeout: time.Minute, artifacts: t.TempDir()}
	if holds, err := run(context.Background(), cfg); holds || err != nil {
		t.Errorf("got %v, %v", holds, err)
	}
	folder := filepath.Join(cfg.artifacts, "seed-7-history-3")
	if _, err := os.Stat(filepath.Join(folder, "history.html")); err != nil {
		t.Error(err)
	}
	if h, err := history.ReadFile(filepath.Join(folder, "history.jsonl")); err != nil || len(h.Operations) != 2 {
		t.Errorf("got %+v, %v", h, err)
	}
}

func TestAHistoryThatCouldNotBeJudgedDoesNotHold(t *testing.T) {
	h := &history.History{Operations: make([]history.Operation, 3)}
	var undecided counts
	undecided.add(h, model.Undecided)
	undecided.add(h, model.Linearizable)
	if undecided.judge(time.Minute) || undecided.Undecided != 1 {
		t.Errorf("got %s", undecided.line())
	}
	if nothing := (counts{}); nothing.judge(time.Minute) {
		t.Error("nothing was judged, and holds")
	}
}

func TestALongTimeWithoutWritesDoesNotHold(t *testing.T) {
	gaps := map[string][]time.Duration{"pause": {time.Hour}}
	for i := range 200 {
		gaps["kill"] = append(gaps["kill"], time.Duration(200-i)*time.Second)
	}
	h := &history.History{Operations: make([]history.Operation, 3), WriteGaps: gaps}
	var c counts
	c.add(h, model.Linearizable)
	if c.judge(197*time.Second) || !c.judge(198*time.Second) || c.Failovers != 201 || c.WriteGaps["kill"].P50 != 100 {
		t.Errorf("got %s", c.line())
	}
}
