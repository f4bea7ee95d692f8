package recorder

import (
	"context"
	"errors"
	"fmt"
	"math/rand/v2"
	"time"

	"hypermap-linearizability/history"
)

const (
	// A client gives up an edit with this probability after each attempt of unknown outcome.
	giveUpShare = 0.15
	// Some attempts have a deadline so short that the server may carry them out or not.
	impatientShare = 0.03
	maxImpatience  = 15 * time.Millisecond
	// A query that waits for a revision is left out after this time: if the revision was lost, then the
	// other operations tell.
	waitDeadline = 2 * time.Second
	// A server that takes this long for an answer hangs, which ends the run.
	callDeadline = 60 * time.Second
	maxAttempt   = 5 * time.Second
	// An operation whose attempts take this long hangs, too.
	operationDeadline = 3 * time.Minute
)

// client makes one operation after another.
type client struct {
	number    int
	random    *rand.Rand
	workload  *workload
	caller    caller
	known     *knowledge
	recording *recording
	// awaitUp returns when the server runs.
	awaitUp func(context.Context) error
	manner  manner
	// acknowledged counts the edits that were.
	acknowledged int
}

// manner is how a client makes its attempts.
type manner struct {
	// deadline ends the first attempt; after one that was too short it is longer, up to maxAttempt.
	deadline time.Duration
	// hangs tells that an attempt without an answer by then ends the run.
	hangs bool
	// giveUp is the probability with which an edit is given up after an attempt of unknown outcome.
	giveUp float64
	// pause is between two attempts.
	pause time.Duration
	// pace is the longest time between two operations.
	pace time.Duration
	// spreads tells that attempts go to different servers. An earlier one may then take effect after a
	// later one was refused.
	spreads bool
}

// toOne is the manner of a client of one server.
var toOne = manner{deadline: callDeadline, hangs: true, giveUp: giveUpShare}

// run makes operations until there are enough of all clients.
func (c *client) run(ctx context.Context) error {
	for ctx.Err() == nil && c.recording.take() {
		if err := c.perform(ctx, c.workload.next()); err != nil {
			return err
		}
		if c.manner.pace > 0 && pause(ctx, randomTime(c.random, c.manner.pace)) != nil {
			return nil // The run has ended, and tells why.
		}
	}
	return nil
}

// perform makes one operation and records it. A read without an answer tells nothing and is left out.
func (c *client) perform(ctx context.Context, request *history.Request) error {
	// A call that only finds the server down would tell nothing.
	if err := c.awaitUp(ctx); err != nil {
		return err
	}
	operation := history.Operation{Client: c.number, Request: *request, Call: c.recording.now()}
	answer, err := c.callUntilKnown(ctx, request, &operation)
	operation.Return = c.recording.now()
	switch {
	case err == nil:
		operation.Answer = answer
		if answer.Status == history.OK && !request.IsRead() {
			c.acknowledged++
		}
		c.known.learn(request, answer)
	case !errors.Is(err, errOutcomeUnknown):
		return fmt.Errorf("client %d: %s: %w", c.number, request.RPC, err)
	case request.IsRead():
		return nil
	default:
		operation.Return = 0
		// The operation goes on until the end of the history, beside those that follow.
		c.number = c.recording.newClient()
	}
	c.recording.add(operation)
	return nil
}

// callUntilKnown repeats an edit with the same request id until its outcome is known, or the client
// gives up. It counts the attempts.
//
// The last answer tells the outcome of all attempts: they come over one connection, so that the server
// learns of the end of an attempt before it gets the next one, unless it was killed in between. Only if
// attempts are spread over servers, a refusal tells nothing of the earlier ones.
func (c *client) callUntilKnown(
	ctx context.Context, request *history.Request, operation *history.Operation,
) (*history.Answer, error) {
	deadline := c.manner.deadline
	for began := time.Now(); ; {
		operation.Attempts++
		sent := time.Now()
		answer, err := c.attempt(ctx, request, deadline)
		if err != nil && time.Since(sent) >= deadline {
			// The machine may be so busy that no answer is in time.
			deadline = min(2*deadline, max(deadline, maxAttempt))
		}
		if c.manner.spreads && operation.Attempts > 1 && err == nil && answer.Status != history.OK {
			return nil, errOutcomeUnknown
		}
		if !errors.Is(err, errOutcomeUnknown) || request.ID == "" || c.random.Float64() < c.manner.giveUp {
			return answer, err
		}
		if time.Since(began) > operationDeadline {
			return nil, fmt.Errorf("no answer within %s", operationDeadline)
		}
		if err := pause(ctx, c.manner.pause); err != nil {
			return nil, err
		}
		if err := c.awaitUp(ctx); err != nil {
			return nil, err
		}
		operation.LastAttempt = c.recording.now()
	}
}

func (c *client) attempt(ctx context.Context, request *history.Request, deadline time.Duration) (*history.Answer, error) {
	longest := deadline
	if c.random.Float64() < impatientShare {
		deadline = randomTime(c.random, maxImpatience)
	} else if request.MinRevision > 0 {
		deadline = min(deadline, waitDeadline)
	}
	ctx, cancel := context.WithTimeout(ctx, deadline)
	defer cancel()
	answer, err := c.caller.call(ctx, request)
	if err != nil && c.manner.hangs && deadline == longest && errors.Is(ctx.Err(), context.DeadlineExceeded) {
		return nil, fmt.Errorf("no answer within %s", callDeadline)
	}
	return answer, err
}

// pause returns after a time, or with an error if the context ends.
func pause(ctx context.Context, duration time.Duration) error {
	select {
	case <-time.After(duration):
		return nil
	case <-ctx.Done():
		return ctx.Err()
	}
}

func randomTime(random *rand.Rand, below time.Duration) time.Duration {
	return time.Duration(random.Int64N(int64(below)))
}
