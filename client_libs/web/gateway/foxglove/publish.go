package foxglove

import (
	"bufio"
	"context"
	"errors"
	"fmt"
	"io"
	"time"

	"connectrpc.com/connect"
	"github.com/coder/websocket"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// writeBytes is the size of the parts in which messages are written.
const writeBytes = 32 << 10

// forever is longer than any wait.
const forever = time.Hour

// due returns what is to be sent, in order of importance.
func (s *session) due(yield func(*paced, func(context.Context) error) bool) {
	if s.list.isDue && !yield(&s.list, s.relist) {
		return
	}
	if s.told.isDue && s.wanted[revisionParameter] && !yield(&s.told, s.tellRevision) {
		return
	}
	for _, channel := range s.channels {
		publish := func(ctx context.Context) error { return s.publish(ctx, channel) }
		if channel.isDue && channel.subscription != nil && !yield(&channel.paced, publish) {
			return
		}
	}
}

// untilDue returns the time until something is to be sent.
func (s *session) untilDue() time.Duration {
	wait := forever
	for pace := range s.due {
		wait = min(wait, time.Until(pace.notBefore))
	}
	return max(wait, 0)
}

// publishNext sends the first thing that is due, if there is one.
func (s *session) publishNext(ctx context.Context) error {
	for pace, send := range s.due {
		started := time.Now()
		if started.Before(pace.notBefore) {
			continue
		}
		// Changes that come from now on may not be in what is read.
		pace.began()
		err := send(ctx)
		pace.ended(time.Since(started))
		return s.tryAgain(ctx, pace, err)
	}
	return nil
}

// refused is an error of the server, or of content that can't be sent. Other errors end the session.
type refused struct {
	about string
	err   error
}

func (r *refused) Error() string { return r.about + ": " + r.err.Error() }

// tryAgain tells the client about an error, and makes what failed due again if that may help.
func (s *session) tryAgain(ctx context.Context, pace *paced, err error) error {
	var problem *refused
	if !errors.As(err, &problem) || ctx.Err() != nil {
		return err
	}
	if mapserver.IsCode(problem.err, connect.CodeUnavailable, connect.CodeResourceExhausted, connect.CodeAborted) {
		pace.retry()
	}
	return s.tellProblem(ctx, problem.about, problem.err)
}

// scope selects layers of the map, in the map's own frame.
func (s *session) scope(layers ...string) *pb.Scope {
	return &pb.Scope{Map: s.name, Layers: layers, Incarnation: s.incarnation}
}

// publish sends the content of a channel to its subscriber.
func (s *session) publish(ctx context.Context, c *channel) error {
	var err error
	if c.layer == nil {
		err = s.publishTransforms(ctx, c)
	} else {
		err = s.publishLayer(ctx, c)
	}
	if err != nil {
		return err
	}
	return s.solved(ctx, c.topic)
}

func (s *session) publishLayer(ctx context.Context, c *channel) error {
	content, err := s.caller.Content(ctx, s.scope(c.layer.GetName()), s.asOf.selected)
	if err != nil {
		return &refused{c.topic, err}
	}
	defer content.Close()
	for _, part := range content.Parts {
		if status := part.GetStatus(); status != pb.AnswerStatus_ANSWER_STATUS_VALUE {
			return &refused{c.topic, fmt.Errorf("the layer can't be shown in the frame %q: %v", s.frame, status)}
		}
	}
	now := time.Now()
	if !hasCells(c.layer) {
		drawn := scene{content.Parts}
		return s.sendContent(ctx, *c.subscription, drawn.size(), now, func(w io.Writer) error {
			return drawn.write(w, s.frame, now)
		})
	}
	cells, err := newGrid(content.Parts)
	if err != nil {
		return &refused{c.topic, err}
	}
	return s.sendContent(ctx, *c.subscription, cells.size(), now, func(w io.Writer) error {
		return cells.write(w, s.frame, newPalette(c.layer, cells), now)
	})
}

func (s *session) publishTransforms(ctx context.Context, c *channel) error {
	transforms, err := s.transforms(ctx)
	if err != nil {
		return &refused{c.topic, err}
	}
	now := time.Now()
	return s.sendContent(ctx, *c.subscription, 0, now, func(w io.Writer) error {
		return writeTransforms(w, transforms, now)
	})
}

// sendContent sends a message with content of about a size, which `write` writes.
func (s *session) sendContent(ctx context.Context, subscription uint32, size int64, now time.Time, write func(io.Writer) error) error {
	ctx, cancel := context.WithTimeout(ctx, s.limits.TimeFor(size))
	defer cancel()
	message, err := s.conn.Writer(ctx, websocket.MessageBinary)
	if err != nil {
		return err
	}
	parts := bufio.NewWriterSize(message, writeBytes)
	// The buffer keeps errors until it is flushed.
	_, _ = parts.Write(contentHeader(subscription, now))
	if err := write(parts); err != nil {
		return err
	}
	if err := parts.Flush(); err != nil {
		return err
	}
	return message.Close()
}
