package recorder

import (
	"context"
	"math/rand/v2"
	"os"
	"path/filepath"
	"testing"

	"hypermap-linearizability/history"
)

// plantBefore puts a fault before calls whose answers name the revisions 1, 2, 3 and so on.
func plantBefore(t *testing.T, name string) (caller, *scriptedCaller) {
	t.Helper()
	plant, err := newPlant(name)
	if err != nil {
		t.Fatal(err)
	}
	calls := &scriptedCaller{answer: func(attempt int) (*history.Answer, error) { return ok(int64(attempt)), nil }}
	return plant.before(calls, rand.New(rand.NewPCG(1, 1))), calls
}

// callOften makes a call n times, and returns the number of answers that name another revision than
// the server's last one.
func callOften(t *testing.T, n int, c caller, calls *scriptedCaller, request *history.Request) int {
	t.Helper()
	others := 0
	for range n {
		answer, err := c.call(context.Background(), request)
		if err != nil {
			t.Fatal(err)
		}
		if answer.Revision != int64(len(calls.requests)) {
			others++
		}
	}
	return others
}

func TestWithoutAPlantCallsPass(t *testing.T) {
	c, calls := plantBefore(t, "")
	if others := callOften(t, 1000, c, calls, edit("e1")); others != 0 || len(calls.requests) != 1000 {
		t.Errorf("%d other answers, %d calls", others, len(calls.requests))
	}
}

func TestAStaleReadAnswersAReadWithoutTheServer(t *testing.T) {
	c, calls := plantBefore(t, StaleRead)
	callOften(t, 1000, c, calls, &history.Request{RPC: history.GetMap})
	if stale := 1000 - len(calls.requests); stale == 0 || stale > 100 {
		t.Errorf("%d of 1000 reads were stale", stale)
	}
	before := len(calls.requests)
	callOften(t, 1000, c, calls, edit("e1"))
	if len(calls.requests) != before+1000 {
		t.Error("edits were not sent")
	}
}

func TestALostUpdateIsAcknowledgedWithTheNextRevision(t *testing.T) {
	c, calls := plantBefore(t, LostUpdate)
	lost := callOften(t, 1000, c, calls, edit("e1"))
	if lost == 0 || lost > 100 || len(calls.requests) != 1000-lost {
		t.Errorf("%d of 1000 edits were lost, %d calls", lost, len(calls.requests))
	}
}

func TestADoubleApplySendsRetriesWithFreshIDs(t *testing.T) {
	c, calls := plantBefore(t, DoubleApply)
	request, other := edit("e1"), edit("e2")
	callOften(t, 3, c, calls, request)
	callOften(t, 1, c, calls, other)
	var ids []string
	for _, sent := range calls.requests {
		ids = append(ids, sent.ID)
	}
	if len(ids) != 4 || ids[0] != "e1" || ids[1] != "e1-1" || ids[2] != "e1-2" || ids[3] != "e2" {
		t.Errorf("sent %v", ids)
	}
}

func TestAnUnknownPlantIsRefused(t *testing.T) {
	if err := CheckPlant("weeds"); err == nil {
		t.Error("accepted")
	}
}

func TestLostCommitsRemovesTheLogOfTheMap(t *testing.T) {
	folder := t.TempDir()
	for _, name := range []string{"site.gpkg", "site.gpkg-wal", "site.gpkg-shm", "catalog.sqlite-wal"} {
		if err := os.WriteFile(filepath.Join(folder, name), nil, 0o644); err != nil {
			t.Fatal(err)
		}
	}
	plant, err := newPlant(LostCommits)
	if err != nil {
		t.Fatal(err)
	}
	if err := plant.afterKill(folder); err != nil {
		t.Fatal(err)
	}
	files, err := os.ReadDir(folder)
	if err != nil || len(files) != 2 || files[0].Name() != "catalog.sqlite-wal" || files[1].Name() != "site.gpkg" {
		t.Errorf("got %v, %v", files, err)
	}
}
