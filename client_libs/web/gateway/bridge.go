package main

import (
	"context"
	"errors"
	"fmt"
	"io"
	"net/http"

	"connectrpc.com/connect"
	"google.golang.org/protobuf/reflect/protoreflect"
)

// maxAnswerBytes is the largest message of an answer. It is above the server's own limit.
const maxAnswerBytes = 64 << 20

// compressMinBytes is the size below which compressing an answer does not pay.
const compressMinBytes = 1024

// method forwards the calls of one rpc to the server. Deadlines and errors are forwarded unchanged. A
// cancellation waits for its turn (resetPacer).
type method struct {
	client *connect.Client[message, message]
	output protoreflect.MessageDescriptor
}

// bridge adds a handler for each method of the service.
func bridge(mux *http.ServeMux, service protoreflect.ServiceDescriptor, server *upstream, calls *calls) {
	for i := range service.Methods().Len() {
		descriptor := service.Methods().Get(i)
		path := "/" + string(service.FullName()) + "/" + string(descriptor.Name())
		m := &method{
			client: connect.NewClient[message, message](server.client, server.url+path,
				connect.WithGRPC(),
				connect.WithCodec(binaryCodec{}),
				// The server is assumed to be near, where compression costs more than it saves.
				connect.WithAcceptCompression("gzip", nil, nil),
				connect.WithReadMaxBytes(maxAnswerBytes)),
			output: descriptor.Output(),
		}
		mux.Handle("POST "+path, calls.bound(descriptor, m.handler(path, descriptor)))
	}
}

func (m *method) handler(path string, descriptor protoreflect.MethodDescriptor) http.Handler {
	options := []connect.HandlerOption{
		connect.WithCodec(binaryCodec{}),
		connect.WithCodec(jsonCodec{}),
		connect.WithRequestInitializer(func(_ connect.Spec, request any) error {
			request.(*message).schema = descriptor.Input()
			return nil
		}),
		connect.WithCompressMinBytes(compressMinBytes),
	}
	switch {
	case descriptor.IsStreamingClient() && descriptor.IsStreamingServer():
		return connect.NewBidiStreamHandler(path, m.bidiStream, options...)
	case descriptor.IsStreamingClient():
		return connect.NewClientStreamHandler(path, m.clientStream, options...)
	case descriptor.IsStreamingServer():
		return connect.NewServerStreamHandler(path, m.serverStream, options...)
	}
	return connect.NewUnaryHandler(path, m.unary, options...)
}

func (m *method) unary(ctx context.Context, request *connect.Request[message]) (*connect.Response[message], error) {
	if err := bodyOf(ctx).checkMessage(request.Msg); err != nil {
		return nil, err
	}
	answer, err := m.client.CallUnary(ctx, onward(request))
	if err != nil {
		return nil, failure(ctx, err)
	}
	return m.response(ctx, answer.Msg)
}

func (m *method) serverStream(ctx context.Context, request *connect.Request[message], out *connect.ServerStream[message]) error {
	if err := bodyOf(ctx).checkMessage(request.Msg); err != nil {
		return err
	}
	answers, err := m.client.CallServerStream(ctx, onward(request))
	if err != nil {
		return failure(ctx, err)
	}
	defer answers.Close()
	bodyOf(ctx).release()
	for answers.Receive() {
		if err := m.forward(ctx, answers.Msg(), out.Send); err != nil {
			return err
		}
	}
	return failure(ctx, answers.Err())
}

func (m *method) clientStream(ctx context.Context, in *connect.ClientStream[message]) (*connect.Response[message], error) {
	requests := m.client.CallClientStream(ctx)
	passHeaders(in.RequestHeader(), requests.RequestHeader())
	for in.Receive() {
		if err := bodyOf(ctx).checkMessage(in.Msg()); err != nil {
			return nil, err
		}
		if err := requests.Send(in.Msg()); err != nil {
			break // CloseAndReceive returns the error of the server.
		}
		bodyOf(ctx).release()
	}
	if err := in.Err(); err != nil {
		return nil, err
	}
	answer, err := requests.CloseAndReceive()
	if err != nil {
		return nil, failure(ctx, err)
	}
	return m.response(ctx, answer.Msg)
}

func (m *method) bidiStream(ctx context.Context, caller *connect.BidiStream[message, message]) error {
	ctx, cancel := context.WithCancel(ctx)
	defer cancel()
	server := m.client.CallBidiStream(ctx)
	passHeaders(caller.RequestHeader(), server.RequestHeader())
	defer server.CloseResponse()
	// Without a first message the call would not begin, and Receive would not notice that it is cancelled.
	if err := server.Send(nil); err != nil && !errors.Is(err, io.EOF) {
		return failure(ctx, err)
	}
	go func() {
		for {
			request, err := caller.Receive()
			if errors.Is(err, io.EOF) {
				_ = server.CloseRequest() // Receive returns the same error.
				return
			}
			if err != nil || bodyOf(ctx).checkMessage(request) != nil {
				cancel()
				return
			}
			if server.Send(request) != nil {
				return // Receive returns the error of the server.
			}
			bodyOf(ctx).release()
		}
	}()
	for {
		answer, err := server.Receive()
		if errors.Is(err, io.EOF) {
			return nil
		}
		if refused := bodyOf(ctx).refusal(); refused != nil && err != nil {
			return refused.failure
		}
		if err != nil {
			return failure(ctx, err)
		}
		if err := m.forward(ctx, answer, caller.Send); err != nil {
			return err
		}
	}
}

// failure converts an error for the caller. Errors of the server are kept. A lost connection becomes
// Unavailable, because the library reports it as an invalid argument in the middle of a stream.
func failure(ctx context.Context, err error) error {
	if err == nil || ctx.Err() != nil {
		return err
	}
	if connect.IsWireError(err) {
		return withMetadata(err)
	}
	if refused := bodyOf(ctx).refusal(); refused != nil {
		return refused.failure
	}
	if connect.CodeOf(err) == connect.CodeResourceExhausted {
		return err // The message is larger than maxAnswerBytes.
	}
	return connect.NewError(connect.CodeUnavailable, fmt.Errorf("the connection to the server: %w", err))
}

// toldWithErrors is what the server tells of a failed call besides the error: by which name its log has the call, and
// when to try again (gRFC A6).
var toldWithErrors = []string{"X-Request-Id", "Grpc-Retry-Pushback-Ms"}

// withMetadata returns an error for the caller with what the server has told of it. The library does not forward the
// metadata of an error that it has received.
func withMetadata(err error) error {
	var received *connect.Error
	if !errors.As(err, &received) {
		return err
	}
	sent := connect.NewError(received.Code(), errors.New(received.Message()))
	for _, detail := range received.Details() {
		sent.AddDetail(detail)
	}
	for _, name := range toldWithErrors {
		if value := received.Meta().Get(name); value != "" {
			sent.Meta().Set(name, value)
		}
	}
	return sent
}

// response returns the only message of an answer. Its memory is released when the call has ended.
func (m *method) response(ctx context.Context, answer *message) (*connect.Response[message], error) {
	if err := m.prepare(ctx, answer); err != nil {
		return nil, err
	}
	return connect.NewResponse(answer), nil
}

// forward sends a message of an answer and releases its memory.
func (m *method) forward(ctx context.Context, answer *message, send func(*message) error) error {
	defer bodyOf(ctx).releaseAnswer()
	if err := m.prepare(ctx, answer); err != nil {
		return err
	}
	return send(answer)
}

// prepare adds the schema to an answer, so that jsonCodec can marshal it, and takes the memory for that.
// The answer itself was charged when it arrived.
func (m *method) prepare(ctx context.Context, answer *message) error {
	answer.schema = m.output
	if body := bodyOf(ctx); body.isJSON {
		return body.takeForAnswer(jsonAnswerBytes(answer.binary, m.output))
	}
	return nil
}

// onward returns the request to the server for a request of a caller.
func onward(request *connect.Request[message]) *connect.Request[message] {
	out := connect.NewRequest(request.Msg)
	passHeaders(request.Header(), out.Header())
	return out
}

// passedHeaders tell the server who calls, by which name its log is to have the call, and the place of the call in
// a trace (https://www.w3.org/TR/trace-context/).
var passedHeaders = []string{"Authorization", "X-Request-Id", "Traceparent", "Tracestate"}

func passHeaders(from, to http.Header) {
	for _, name := range passedHeaders {
		for _, value := range from.Values(name) {
			to.Add(name, value)
		}
	}
}
