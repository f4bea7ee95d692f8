package recorder

import (
	"context"
	"math/rand/v2"

	"hypermap-linearizability/history"
)

// lossyCaller drops the answers to some edits that the server has carried out or refused, like a
// connection that breaks before the answer has arrived.
type lossyCaller struct {
	caller
	random *rand.Rand
}

const lostAnswers = 0.03

func (c lossyCaller) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	answer, err := c.caller.call(ctx, request)
	if err == nil && !request.IsRead() && c.random.Float64() < lostAnswers {
		return nil, errOutcomeUnknown
	}
	return answer, err
}
