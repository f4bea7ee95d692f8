package recorder

import (
	"context"
	"fmt"
	"math/rand/v2"
	"os"
	"path/filepath"
	"strconv"
	"strings"
	"sync"

	"hypermap-linearizability/history"
)

// The names of the faults that can be planted, to show that they are found.
const (
	// StaleRead answers some reads with an earlier answer to the same read.
	StaleRead = "stale_read"
	// LostUpdate acknowledges some edits without sending them.
	LostUpdate = "lost_update"
	// DoubleApply sends retries with request ids of their own.
	DoubleApply = "double_apply"
	// LostCommits removes the write-ahead log of the map's file when the server has been killed, as if
	// commits had been acknowledged before they were on disk.
	LostCommits = "lost_commits"
	// LocalReads sends the questions to several servers without asking for linearizable answers.
	LocalReads = "local_reads"
)

// Plants returns the names of all faults.
func Plants() []string { return []string{StaleRead, LostUpdate, DoubleApply, LostCommits, LocalReads} }

// plant is a fault between the clients and the server, or of the server's disk.
type plant struct {
	// before puts the fault before a client's calls. All clients of a history share its memory.
	before func(caller, *rand.Rand) caller
	// afterKill damages the data folder of a server that was killed.
	afterKill func(dataDir string) error
}

// newPlant returns the fault of this name; an empty name means none.
func newPlant(name string) (plant, error) {
	none := plant{
		before:    func(c caller, _ *rand.Rand) caller { return c },
		afterKill: func(string) error { return nil },
	}
	planted := none
	switch name {
	case "":
	case StaleRead:
		answers := &answerMemory{earlier: map[string]*history.Answer{}}
		planted.before = func(c caller, random *rand.Rand) caller { return staleReads{c, random, answers} }
	case LostUpdate:
		newest := &newestAnswer{}
		planted.before = func(c caller, random *rand.Rand) caller { return lostUpdates{c, random, newest} }
	case DoubleApply:
		sent := &sentRequests{attempts: map[*history.Request]int{}}
		planted.before = func(c caller, _ *rand.Rand) caller { return freshIDs{c, sent} }
	case LocalReads:
		planted.before = func(c caller, _ *rand.Rand) caller { return localReads{c} }
	case LostCommits:
		planted.afterKill = removeLogs
	default:
		return none, fmt.Errorf("no fault %q; there are %s", name, strings.Join(Plants(), ", "))
	}
	return planted, nil
}

// CheckPlant returns an error if there is no fault of this name.
func CheckPlant(name string) error {
	_, err := newPlant(name)
	return err
}

// removeLogs removes SQLite's write-ahead logs.
func removeLogs(dataDir string) error {
	for _, pattern := range []string{"*.gpkg-wal", "*.gpkg-shm"} {
		files, err := filepath.Glob(filepath.Join(dataDir, pattern))
		if err != nil {
			return err
		}
		for _, file := range files {
			if err := os.Remove(file); err != nil {
				return err
			}
		}
	}
	return nil
}

const (
	staleReadShare  = 0.02
	lostUpdateShare = 0.02
)

// answerMemory has an earlier answer to each read.
type answerMemory struct {
	mutex   sync.Mutex
	earlier map[string]*history.Answer
}

type staleReads struct {
	caller
	random  *rand.Rand
	answers *answerMemory
}

func (c staleReads) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	if !request.IsRead() || request.AtRevision != nil {
		return c.caller.call(ctx, request)
	}
	key := fmt.Sprint(request.RPC, request.Place)
	if c.random.Float64() < staleReadShare {
		c.answers.mutex.Lock()
		earlier := c.answers.earlier[key]
		c.answers.mutex.Unlock()
		if earlier != nil && earlier.Revision >= request.MinRevision {
			return earlier, nil
		}
	}
	answer, err := c.caller.call(ctx, request)
	if err == nil && answer.Status == history.OK {
		c.answers.mutex.Lock()
		c.answers.earlier[key] = answer
		c.answers.mutex.Unlock()
	}
	return answer, err
}

// newestAnswer has the answer that named the newest revision.
type newestAnswer struct {
	mutex  sync.Mutex
	answer history.Answer
}

func (n *newestAnswer) get() history.Answer {
	n.mutex.Lock()
	defer n.mutex.Unlock()
	return n.answer
}

func (n *newestAnswer) add(answer *history.Answer) {
	n.mutex.Lock()
	defer n.mutex.Unlock()
	if answer.Revision > n.answer.Revision {
		n.answer = *answer
	}
}

type lostUpdates struct {
	caller
	random *rand.Rand
	newest *newestAnswer
}

func (c lostUpdates) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	isPut := len(request.Edits) == 1 && request.Edits[0].Action == history.Put
	if newest := c.newest.get(); isPut && newest.Revision > 0 && c.random.Float64() < lostUpdateShare {
		return &history.Answer{
			Status:      history.OK,
			Incarnation: newest.Incarnation,
			Revision:    newest.Revision + 1,
			ObjectIDs:   []int64{request.Edits[0].ID},
		}, nil
	}
	answer, err := c.caller.call(ctx, request)
	if err == nil {
		c.newest.add(answer)
	}
	return answer, err
}

// sentRequests counts how often each request was sent.
type sentRequests struct {
	mutex    sync.Mutex
	attempts map[*history.Request]int
}

type freshIDs struct {
	caller
	sent *sentRequests
}

func (c freshIDs) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	if request.ID == "" {
		return c.caller.call(ctx, request)
	}
	c.sent.mutex.Lock()
	attempt := c.sent.attempts[request]
	c.sent.attempts[request]++
	c.sent.mutex.Unlock()
	if attempt == 0 {
		return c.caller.call(ctx, request)
	}
	fresh := *request
	fresh.ID += "-" + strconv.Itoa(attempt)
	return c.caller.call(ctx, &fresh)
}

type localReads struct{ caller }

func (c localReads) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	local := *request
	local.Linearizable = false
	return c.caller.call(ctx, &local)
}
