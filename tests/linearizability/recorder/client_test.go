package recorder

import (
	"context"
	"errors"
	"math/rand/v2"
	"testing"

	"hypermap-linearizability/history"
)

// scriptedCaller answers as a function says, and remembers the requests.
type scriptedCaller struct {
	answer   func(attempt int) (*history.Answer, error)
	requests []history.Request
}

func (c *scriptedCaller) call(_ context.Context, request *history.Request) (*history.Answer, error) {
	c.requests = append(c.requests, *request)
	return c.answer(len(c.requests))
}

func newTestClient(answers caller) *client {
	random := rand.New(rand.NewPCG(1, 1))
	r := newRecording(10)
	known := newKnowledge(history.Map{Revision: 1, Objects: []history.Object{{ID: 1, Version: 1, Value: 1}}})
	return &client{
		number: r.newClient(), random: random, recording: r, known: known, caller: answers,
		workload: &workload{random: random, places: 1, known: known},
		awaitUp:  func(context.Context) error { return nil },
		manner:   toOne,
	}
}

func edit(id string) *history.Request {
	return &history.Request{RPC: history.ApplyEdits, ID: id, Edits: []history.Edit{{Action: history.Put, ID: 1, Value: 2}}}
}

func ok(revision int64) *history.Answer {
	return &history.Answer{Status: history.OK, Revision: revision, ObjectIDs: []int64{1}}
}

func TestAnEditIsRepeatedUntilItsOutcomeIsKnown(t *testing.T) {
	calls := &scriptedCaller{answer: func(attempt int) (*history.Answer, error) {
		if attempt < 3 {
			return nil, errOutcomeUnknown
		}
		return ok(2), nil
	}}
	c := newTestClient(calls)
	if err := c.perform(context.Background(), edit("e1")); err != nil {
		t.Fatal(err)
	}
	recorded := c.recording.operations
	if len(recorded) != 1 || recorded[0].Answer == nil || recorded[0].Attempts != 3 || recorded[0].Answer.Revision != 2 {
		t.Fatalf("got %+v", recorded)
	}
	for _, request := range calls.requests {
		if !request.SameAs(edit("e1")) {
			t.Errorf("sent %+v", request)
		}
	}
	if c.known.newestRevision() != 2 {
		t.Errorf("the newest known revision is %d", c.known.newestRevision())
	}
}

func TestARefusalByAnotherServerTellsNothingOfEarlierAttempts(t *testing.T) {
	refused := &history.Answer{Status: history.Aborted}
	for _, unknown := range []int{0, 1} {
		calls := &scriptedCaller{answer: func(attempt int) (*history.Answer, error) {
			if attempt <= unknown {
				return nil, errOutcomeUnknown
			}
			return refused, nil
		}}
		c := newTestClient(calls)
		c.manner = spread
		if err := c.perform(context.Background(), edit("e1")); err != nil {
			t.Fatal(err)
		}
		recorded := c.recording.operations
		if len(recorded) != 1 || (recorded[0].Answer == nil) != (unknown == 1) {
			t.Errorf("after %d attempts of unknown outcome got %+v", unknown, recorded)
		}
	}
}

func TestAnEditWithoutAnIDIsSentOnceAndStaysUnknown(t *testing.T) {
	calls := &scriptedCaller{answer: func(int) (*history.Answer, error) { return nil, errOutcomeUnknown }}
	c := newTestClient(calls)
	before := c.number
	if err := c.perform(context.Background(), edit("")); err != nil {
		t.Fatal(err)
	}
	recorded := c.recording.operations
	if len(calls.requests) != 1 || len(recorded) != 1 || recorded[0].Answer != nil || recorded[0].Return != 0 {
		t.Fatalf("%d calls, recorded %+v", len(calls.requests), recorded)
	}
	if recorded[0].Client != before || c.number == before {
		t.Errorf("the operation is of client %d, which was %d and is %d", recorded[0].Client, before, c.number)
	}
}

func TestAReadWithoutAnAnswerIsLeftOut(t *testing.T) {
	calls := &scriptedCaller{answer: func(int) (*history.Answer, error) { return nil, errOutcomeUnknown }}
	c := newTestClient(calls)
	for range 20 {
		if err := c.perform(context.Background(), &history.Request{RPC: history.GetMap}); err != nil {
			t.Fatal(err)
		}
	}
	if len(c.recording.operations) != 0 {
		t.Errorf("recorded %+v", c.recording.operations)
	}
}

func TestAnErrorThatNoRequestShouldGetEndsTheRun(t *testing.T) {
	unexpected := errors.New("unexpected")
	c := newTestClient(&scriptedCaller{answer: func(int) (*history.Answer, error) { return nil, unexpected }})
	if err := c.perform(context.Background(), edit("e1")); !errors.Is(err, unexpected) {
		t.Errorf("got %v", err)
	}
}

func TestMarksAreClosedWhenTheirOperationBegins(t *testing.T) {
	r := newRecording(3)
	second := r.mark(2)
	r.take()
	select {
	case <-second:
		t.Fatal("closed too early")
	default:
	}
	r.take()
	<-second
	if !r.take() || r.take() {
		t.Error("not three operations")
	}
}
