package recorder

import (
	"context"
	"errors"

	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/status"
	"google.golang.org/protobuf/types/dynamicpb"

	"hypermap-linearizability/history"
)

// errOutcomeUnknown means that the call ended without an answer. A read has told nothing then, and an
// edit may have been carried out or not.
var errOutcomeUnknown = errors.New("the outcome is unknown")

// caller makes the calls of one client. Any error but errOutcomeUnknown ends the run.
type caller interface {
	call(ctx context.Context, request *history.Request) (*history.Answer, error)
}

// serverCaller calls the server.
type serverCaller struct{ *connection }

func (c serverCaller) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	answer, err := c.send(ctx, request)
	if err == nil {
		return answer, nil
	}
	switch status.Code(err) {
	case codes.Aborted:
		return &history.Answer{Status: history.Aborted}, nil
	case codes.NotFound:
		return &history.Answer{Status: history.NotFound}, nil
	case codes.InvalidArgument:
		return &history.Answer{Status: history.InvalidArgument}, nil
	case codes.OutOfRange:
		return &history.Answer{Status: history.OutOfRange}, nil
	case codes.Unavailable, codes.DeadlineExceeded, codes.Canceled:
		return nil, errOutcomeUnknown
	}
	return nil, err
}

func (c serverCaller) send(ctx context.Context, request *history.Request) (*history.Answer, error) {
	switch request.RPC {
	case history.ApplyEdits:
		var answer editsAnswer
		if err := c.callOnce(ctx, "EditService.ApplyEdits", encodeEdits(request), &answer); err != nil {
			return nil, err
		}
		return answer.decode()
	case history.GetMap:
		var answer mapAnswer
		if err := c.callOnce(ctx, "CatalogService.GetMap", object{"map": mapName}, &answer); err != nil {
			return nil, err
		}
		return &history.Answer{Status: history.OK, Revision: answer.Map.Revision, Incarnation: answer.Map.Incarnation}, nil
	}
	answer := &history.Answer{}
	add := func(message *dynamicpb.Message) error {
		var part queryAnswer
		if err := decode(message, &part); err != nil {
			return err
		}
		return part.addTo(answer, request.RPC)
	}
	err := c.connection.call(ctx, "QueryService."+string(request.RPC), encodeQuery(request), add)
	if err == nil && answer.Status == "" {
		err = errors.New("an answer without messages")
	}
	return answer, err
}
