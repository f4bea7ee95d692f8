package model

import (
	"math/rand/v2"
	"testing"
	"time"

	"github.com/anishathalye/porcupine"

	"hypermap-linearizability/history"
)

func judgeWithoutCuts(h *history.History) Verdict {
	return verdictOf(porcupine.CheckOperationsTimeout(newModel(h, nil), operationsOf(h), time.Minute))
}

// randomHistory makes operations in some order, by the model, and spreads each over the time before and
// after its turn. The answers of some are then changed, hidden or exchanged.
func randomHistory(random *rand.Rand) *history.History {
	const turns = 12
	h := &history.History{Initial: initialMap()}
	s := newState(h.Initial)
	for turn := range turns {
		request := randomRequest(random, turn)
		var answer history.Answer
		answer, s = answerOf(s, &request)
		before, after := time.Duration(random.Int64N(30)), time.Duration(random.Int64N(30))
		at := time.Duration(10*turn + 30)
		h.Operations = append(h.Operations, span(at-before, at+after, done{request, &answer}))
	}
	for range random.IntN(4) {
		answer := h.Operations[random.IntN(turns)].Answer
		switch random.IntN(5) {
		case 0:
			answer.Revision++
		case 1:
			answer.Revision--
		case 2:
			*answer = *h.Operations[random.IntN(turns)].Answer
		case 3:
			answer.Status = history.Aborted
		default:
			answer.Objects = nil
		}
	}
	for i := range h.Operations {
		if random.IntN(4) == 0 {
			h.Operations[i].Answer = nil
		}
	}
	return h
}

func randomRequest(random *rand.Rand, turn int) history.Request {
	id := random.Int64N(3) + 1
	version := ref(random.Int64N(4) + 1)
	name := string(rune('a' + random.IntN(20)))
	switch random.IntN(7) {
	case 0:
		return edits(name, put(id, int64(turn)))
	case 1:
		return edits(name, putIf(id, int64(turn), *version))
	case 2:
		return edits(name, put(1, int64(turn)), remove(id))
	case 3:
		return edits("", create(int(id), int64(turn)))
	case 4:
		return past(*version)
	case 5:
		return newest()
	}
	return all()
}

// answerOf returns the one legal answer in a state, and the state after it.
func answerOf(s *state, request *history.Request) (history.Answer, *state) {
	answer := history.Answer{Status: history.OK, Incarnation: incarnation}
	if request.IsRead() {
		seen := s
		if request.AtRevision != nil {
			if seen = s.at(*request.AtRevision); seen == nil {
				return history.Answer{Status: history.OutOfRange}, s
			}
		}
		answer.Revision = seen.revision
		if request.RPC != history.GetMap {
			answer.Objects = seen.objects
		}
		return answer, s
	}
	made := s.receipt(request.ID)
	if made != nil && !made.made.SameAs(request) {
		return history.Answer{Status: history.InvalidArgument}, s
	}
	next := s
	if made == nil {
		var status history.Status
		if next, status = s.next(request); status != history.OK {
			return history.Answer{Status: status}, s
		}
		made = next
	}
	answer.Revision, answer.ObjectIDs = made.revision, made.ids
	return answer, next
}

func TestCutsDoNotChangeTheVerdict(t *testing.T) {
	seed := rand.Uint64N(1_000_000)
	random := rand.New(rand.NewPCG(seed, 0))
	verdicts := map[Verdict]int{}
	for i := range 3000 {
		h := randomHistory(random)
		with, without := Judge(h, time.Minute), judgeWithoutCuts(h)
		if with != without {
			t.Fatalf("seed %d, history %d: verdict %d, without cuts %d", seed, i, with, without)
		}
		verdicts[with]++
	}
	t.Logf("seed %d: %d linearizable, %d not", seed, verdicts[Linearizable], verdicts[Violation])
	if verdicts[Linearizable] < 100 || verdicts[Violation] < 100 {
		t.Errorf("seed %d: the histories are too much alike: %v", seed, verdicts)
	}
}
