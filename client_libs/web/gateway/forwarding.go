package main

import (
	"context"
	"errors"
	"io"
	"net/http"
	"net/http/httptrace"
	"sync"
	"time"
)

// forwarding follows the calls to the server that are made for one call of a client, usually one. Safe for
// concurrent use.
type forwarding struct {
	body *requestBody

	mu     sync.Mutex
	open   int
	closed bool
	ended  sync.Cond // open is 0
}

func newForwarding(body *requestBody) *forwarding {
	f := &forwarding{body: body}
	f.ended.L = &f.mu
	return f
}

// begin counts a call to the server. It returns false if the client's call has ended.
func (f *forwarding) begin() bool {
	f.mu.Lock()
	defer f.mu.Unlock()
	if f.closed {
		return false
	}
	f.open++
	return true
}

func (f *forwarding) end() {
	f.mu.Lock()
	defer f.mu.Unlock()
	if f.open--; f.open == 0 {
		f.ended.Broadcast()
	}
}

// wait returns when all calls to the server have ended, and lets no other begin.
func (f *forwarding) wait() {
	f.mu.Lock()
	defer f.mu.Unlock()
	f.closed = true
	for f.open > 0 {
		f.ended.Wait()
	}
}

type forwardingKey struct{}

func withForwarding(ctx context.Context, f *forwarding) context.Context {
	return context.WithValue(ctx, forwardingKey{}, f)
}

// pacedTransport makes the calls to the server. It charges the messages of their answers to the client's
// call before it returns them, and cancels calls at the pace of resets.
//
// A call that its client has given up goes on until its turn comes: what the server sends is dropped, and
// many calls end by themselves. Its messages are sent to their end, because hypermapd counts the bytes of
// parts of messages against the connection.
type pacedTransport struct {
	http.RoundTripper
	resets *resetPacer
	// The longest time that the rest of a message may take to be sent before its call is cancelled anyway.
	patience time.Duration
}

func (t *pacedTransport) RoundTrip(r *http.Request) (*http.Response, error) {
	forwarded, ok := r.Context().Value(forwardingKey{}).(*forwarding)
	if !ok {
		return t.RoundTripper.RoundTrip(r)
	}
	if !forwarded.begin() {
		return nil, errEnded
	}
	if err := r.Context().Err(); err != nil {
		forwarded.end()
		return nil, err
	}
	call, out := t.newCall(r, forwarded)
	answer, err := t.RoundTripper.RoundTrip(out)
	if err != nil {
		call.end()
		if r.Context().Err() != nil {
			err = r.Context().Err()
		}
		return nil, err
	}
	answer.Body = &answerBody{ReadCloser: answer.Body, call: call}
	return answer, nil
}

// serverCall is a call to the server.
type serverCall struct {
	transport *pacedTransport
	forwarded *forwarding
	request   *sentBody
	cancel    context.CancelFunc
	unwatch   func() bool

	abandoned sync.Once
	finished  sync.Once
	ended     chan struct{}
}

// newCall returns a call, and the request for it, which is not cancelled with the context of r.
func (t *pacedTransport) newCall(r *http.Request, forwarded *forwarding) (*serverCall, *http.Request) {
	ctx, cancel := context.WithCancel(context.WithoutCancel(r.Context()))
	hasBody := r.Body != nil && r.Body != http.NoBody
	call := &serverCall{
		transport: t,
		forwarded: forwarded,
		cancel:    cancel,
		ended:     make(chan struct{}),
		request: &sentBody{
			ReadCloser: r.Body,
			isStream:   r.ContentLength < 0,
			sent:       make(chan struct{}, 1),
			isSent:     true,
			isWhole:    !hasBody,
		},
	}
	watched := make(chan struct{}) // closed when call.unwatch is set
	call.unwatch = context.AfterFunc(r.Context(), func() {
		<-watched
		call.abandon()
	})
	close(watched)
	out := r.WithContext(httptrace.WithClientTrace(ctx, &httptrace.ClientTrace{
		WroteRequest: func(httptrace.WroteRequestInfo) { call.request.written() },
	}))
	if hasBody {
		out.Body = call.request
	}
	return call, out
}

// abandon cancels the call when its turn comes, unless it has ended by then.
func (c *serverCall) abandon() {
	c.abandoned.Do(func() {
		c.request.waitUntilSent(c.ended, c.transport.patience)
		c.transport.resets.wait(c.forwarded.body.address, c.ended)
		c.end()
	})
}

// end tells that the call has ended.
func (c *serverCall) end() {
	c.finished.Do(func() {
		close(c.ended)
		c.unwatch()
		c.cancel()
		c.forwarded.end()
	})
}

// endAnswered ends a call whose answer is complete. If its request is not, HTTP/2 resets the stream at once.
// That reset can't be delayed, so it takes a turn afterwards, and the client's call counts as open until then.
func (c *serverCall) endAnswered() {
	if c.request.ends() {
		c.end()
		return
	}
	go func() {
		c.abandoned.Do(func() { c.transport.resets.wait(c.forwarded.body.address, nil) })
		c.end()
	}()
}

// answerBody is the body of an answer of the server.
type answerBody struct {
	io.ReadCloser
	call     *serverCall
	messages envelopes
	refused  error
}

func (b *answerBody) Read(data []byte) (int, error) {
	if b.refused != nil {
		return 0, b.refused
	}
	n, err := b.ReadCloser.Read(data)
	b.messages.follow(data[:n], func(length int64) {
		if b.refused == nil && length <= maxAnswerBytes {
			b.refused = b.call.forwarded.body.takeForAnswer(copiesOfMessage * length)
		}
	})
	if err != nil {
		b.call.endAnswered()
	}
	return n, err
}

// Close abandons the call if its answer has not been read to the end, and does not wait for it.
func (b *answerBody) Close() error {
	select {
	case <-b.call.ended:
		return b.ReadCloser.Close()
	default:
	}
	go b.call.abandon()
	go func() {
		_, _ = io.Copy(io.Discard, b.ReadCloser) // Until the end of the answer, or the turn of the call.
		_ = b.ReadCloser.Close()
		b.call.endAnswered()
	}()
	return nil
}

// sentBody is the body of a request to the server. It knows whether its messages have been sent whole.
type sentBody struct {
	io.ReadCloser
	// Whether there may be several messages.
	isStream bool
	// Has a value when isSent may have changed.
	sent chan struct{}

	mu       sync.Mutex
	messages envelopes
	// Whether all messages that were read have been written to the connection.
	isSent bool
	// Whether the end was read.
	isWhole bool
}

// Read is called by the transport, which writes what it has read before it reads more of a stream.
func (b *sentBody) Read(data []byte) (int, error) {
	b.mu.Lock()
	b.setSentLocked(b.isStream && b.messages.isBetween())
	b.mu.Unlock()
	n, err := b.ReadCloser.Read(data)
	b.mu.Lock()
	defer b.mu.Unlock()
	if n > 0 {
		b.messages.follow(data[:n], func(int64) {})
		b.setSentLocked(false)
	}
	if errors.Is(err, io.EOF) {
		b.isWhole = true
	}
	return n, err
}

// written tells that the whole request has been written, or is not written further.
func (b *sentBody) written() {
	b.mu.Lock()
	defer b.mu.Unlock()
	b.setSentLocked(true)
}

func (b *sentBody) setSentLocked(isSent bool) {
	b.isSent = isSent
	select {
	case b.sent <- struct{}{}:
	default:
	}
}

func (b *sentBody) ends() bool {
	b.mu.Lock()
	defer b.mu.Unlock()
	return b.isWhole
}

// waitUntilSent waits until no message has been sent in part, the call has ended, or the time has passed.
func (b *sentBody) waitUntilSent(ended <-chan struct{}, most time.Duration) {
	late := time.NewTimer(most)
	defer late.Stop()
	for {
		b.mu.Lock()
		isSent := b.isSent
		b.mu.Unlock()
		if isSent {
			return
		}
		select {
		case <-b.sent:
		case <-ended:
			return
		case <-late.C:
			return
		}
	}
}
