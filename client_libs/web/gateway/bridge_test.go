package main

import (
	"context"
	"errors"
	"io"
	"net/http"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/genproto/googleapis/rpc/errdetails"
	"google.golang.org/grpc"
	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/metadata"
	"google.golang.org/grpc/status"
)

// echo answers each request with the method and the content of the request.
func echo(path string, stream grpc.ServerStream) error {
	for {
		var request message
		if err := stream.RecvMsg(&request); errors.Is(err, io.EOF) {
			return nil
		} else if err != nil {
			return err
		}
		answer := &message{binary: []byte(path + " " + string(request.binary))}
		if err := stream.SendMsg(answer); err != nil {
			return err
		}
	}
}

func TestUnaryAnswersAreForwarded(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", echo)
	gateway := startGateway(t, before(server))
	forEachProtocol(t, func(t *testing.T, as caller) {
		long := strings.Repeat("x", 1<<20)
		for _, text := range []string{"", "hello", long} {
			answer, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw(text))
			if err != nil {
				t.Fatal(err)
			}
			if got := string(answer.Msg.binary); got != queryPoint+" "+text {
				t.Errorf("got %d bytes for %d", len(got), len(text))
			}
		}
	})
}

func TestStreamedAnswersAreForwardedInOrder(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		for i := range 1000 {
			if err := stream.SendMsg(&message{binary: []byte{byte(i), byte(i >> 8)}}); err != nil {
				return err
			}
		}
		return nil
	})
	gateway := startGateway(t, before(server))
	forEachProtocol(t, func(t *testing.T, as caller) {
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		count := 0
		for ; stream.Receive(); count++ {
			if got := stream.Msg().binary; int(got[0])|int(got[1])<<8 != count {
				t.Fatalf("message %d is %v", count, got)
			}
		}
		if stream.Err() != nil || count != 1000 {
			t.Errorf("%d messages, error %v", count, stream.Err())
		}
	})
}

func TestErrorsAreForwardedWithCodeMessageAndDetails(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		if path == watch {
			if err := stream.SendMsg(&message{binary: []byte("first")}); err != nil {
				return err
			}
		}
		stream.SetTrailer(metadata.Pairs("x-request-id", "0123456789abcdef", "grpc-retry-pushback-ms", "250"))
		failure, err := status.New(codes.NotFound, "no map \"größe\"").
			WithDetails(&errdetails.ErrorInfo{Reason: "because"})
		if err != nil {
			return err
		}
		return failure.Err()
	})
	gateway := startGateway(t, before(server))
	check := func(t *testing.T, err error) {
		t.Helper()
		var failure *connect.Error
		if !errors.As(err, &failure) {
			t.Fatalf("not an error of the protocol: %v", err)
		}
		if failure.Code() != connect.CodeNotFound || failure.Message() != "no map \"größe\"" {
			t.Errorf("got %v", failure)
		}
		if id := failure.Meta().Get("X-Request-Id"); id != "0123456789abcdef" {
			t.Errorf("the name of the call in the server's log: %q", id)
		}
		if pause := failure.Meta().Get("Grpc-Retry-Pushback-Ms"); pause != "250" {
			t.Errorf("when to try again: %q", pause)
		}
		if len(failure.Details()) != 1 {
			t.Fatalf("details: %v", failure.Details())
		}
		detail, err := failure.Details()[0].Value()
		if info, ok := detail.(*errdetails.ErrorInfo); err != nil || !ok || info.Reason != "because" {
			t.Errorf("detail %v, error %v", detail, err)
		}
	}
	forEachProtocol(t, func(t *testing.T, as caller) {
		_, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw(""))
		check(t, err)
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() || string(stream.Msg().binary) != "first" {
			t.Fatalf("the message before the error is lost: %v", stream.Err())
		}
		if stream.Receive() {
			t.Fatal("a message after the error")
		}
		check(t, stream.Err())
	})
}

func TestIdentityNameAndTraceOfACallAreForwarded(t *testing.T) {
	sent := map[string]string{
		"authorization": "Bearer secret",
		"x-request-id":  "shift-17/call-4",
		"traceparent":   "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
		"tracestate":    "vendor=1",
	}
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		got, _ := metadata.FromIncomingContext(stream.Context())
		for name, value := range sent {
			if strings.Join(got[name], "|") != value {
				return status.Errorf(codes.Internal, "%s: %q", name, got[name])
			}
		}
		if len(got["cookie"]) > 0 || len(got["x-other"]) > 0 {
			return status.Error(codes.Internal, "other headers were forwarded")
		}
		return stream.SendMsg(&message{binary: []byte("all came")})
	})
	gateway := startGateway(t, before(server))
	named := func() *connect.Request[message] {
		request := raw("")
		for name, value := range sent {
			request.Header().Set(name, value)
		}
		request.Header().Set("X-Other", "1")
		return request
	}
	forEachProtocol(t, func(t *testing.T, as caller) {
		answer, err := as.to(gateway, queryPoint).CallUnary(testContext(t), named())
		if err != nil || string(answer.Msg.binary) != "all came" {
			t.Errorf("unary: %v, error %v", answer, err)
		}
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), named())
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() || string(stream.Msg().binary) != "all came" {
			t.Errorf("stream: error %v", stream.Err())
		}
	})
}

func TestDeadlinesAreForwarded(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		if at, ok := stream.Context().Deadline(); !ok || time.Until(at) > deadline {
			return status.Error(codes.Internal, "no deadline")
		}
		return stream.SendMsg(&message{})
	})
	gateway := startGateway(t, before(server))
	forEachProtocol(t, func(t *testing.T, as caller) {
		if _, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw("")); err != nil {
			t.Error(err)
		}
	})
}

func TestEachMessageOfAStreamIsForwardedAtOnce(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		goOn := make(chan struct{})
		server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
			for range 3 {
				if err := stream.SendMsg(&message{binary: []byte("change")}); err != nil {
					return err
				}
				select {
				case <-goOn:
				case <-stream.Context().Done():
					return stream.Context().Err()
				}
			}
			return nil
		})
		gateway := startGateway(t, before(server))
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		for range 3 {
			if !stream.Receive() {
				t.Fatal(stream.Err())
			}
			goOn <- struct{}{}
		}
	})
}

func TestCancellationIsForwarded(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		gone := make(chan error, 1)
		server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
			if err := stream.SendMsg(&message{}); err != nil {
				return err
			}
			<-stream.Context().Done()
			gone <- stream.Context().Err()
			return stream.Context().Err()
		})
		gateway := startGateway(t, before(server))
		ctx, cancel := context.WithCancel(testContext(t))
		stream, err := as.to(gateway, watch).CallServerStream(ctx, raw(""))
		if err != nil {
			t.Fatal(err)
		}
		if !stream.Receive() {
			t.Fatal(stream.Err())
		}
		cancel()
		select {
		case err := <-gone:
			if !errors.Is(err, context.Canceled) {
				t.Errorf("the server's context ended with: %v", err)
			}
		case <-time.After(deadline):
			t.Error("the server's context was not cancelled")
		}
	})
}

func TestAServerThatIsDownIsUnavailableUntilItComesBack(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		// Nobody else takes ports of this address while the server is down.
		address, server := startBackend(t, "127.0.0.9:0", echo)
		gateway := startGateway(t, before(address))
		client := as.to(gateway, queryPoint)
		if _, err := client.CallUnary(testContext(t), raw("")); err != nil {
			t.Fatal(err)
		}
		server.Stop()
		_, err := client.CallUnary(testContext(t), raw(""))
		if connect.CodeOf(err) != connect.CodeUnavailable {
			t.Errorf("down: %v", err)
		}
		startBackend(t, address, echo)
		if _, err := client.CallUnary(testContext(t), raw("")); err != nil {
			t.Errorf("back: %v", err)
		}
	})
}

func TestAStreamIsUnavailableWhenTheServerDies(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		address, server := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
			if err := stream.SendMsg(&message{}); err != nil {
				return err
			}
			<-stream.Context().Done()
			return stream.Context().Err()
		})
		gateway := startGateway(t, before(address))
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() {
			t.Fatal(stream.Err())
		}
		server.Stop()
		if stream.Receive() || connect.CodeOf(stream.Err()) != connect.CodeUnavailable {
			t.Errorf("got %v", stream.Err())
		}
	})
}

func TestStreamsOfRequestsAreForwarded(t *testing.T) {
	collect := func(path string, stream grpc.ServerStream) error {
		if path == observe {
			return echo(path, stream)
		}
		var all strings.Builder
		for {
			var request message
			if err := stream.RecvMsg(&request); errors.Is(err, io.EOF) {
				return stream.SendMsg(&message{binary: []byte(all.String())})
			} else if err != nil {
				return err
			}
			all.Write(request.binary)
		}
	}
	server, _ := startBackend(t, "127.0.0.1:0", collect)
	gateway := startGateway(t, before(server))
	grpcCaller := callers[2]

	upload := grpcCaller.to(gateway, importMap).CallClientStream(testContext(t))
	for _, part := range []string{"one ", "two ", "three"} {
		if err := upload.Send(raw(part).Msg); err != nil {
			t.Fatal(err)
		}
	}
	answer, err := upload.CloseAndReceive()
	if err != nil || string(answer.Msg.binary) != "one two three" {
		t.Errorf("client stream: %v, error %v", answer, err)
	}

	talk := grpcCaller.to(gateway, observe).CallBidiStream(testContext(t))
	for _, word := range []string{"one", "two", "three"} {
		if err := talk.Send(raw(word).Msg); err != nil {
			t.Fatal(err)
		}
		answer, err := talk.Receive()
		if err != nil || string(answer.binary) != observe+" "+word {
			t.Fatalf("bidi stream: %v, error %v", answer, err)
		}
	}
	if err := talk.CloseRequest(); err != nil {
		t.Fatal(err)
	}
	if _, err := talk.Receive(); !errors.Is(err, io.EOF) {
		t.Errorf("the end of a bidi stream: %v", err)
	}
}

func TestMessagesInJSONAreTranslated(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		var request message
		if err := stream.RecvMsg(&request); err != nil {
			return err
		}
		if got := toJSON(t, "QueryPointRequest", &request); got != `{"scope":{"map":"office"},"point":{"x":1,"y":2}}` {
			return status.Error(codes.InvalidArgument, got)
		}
		return stream.SendMsg(fromJSON(t, "QueryPointResponse", `{"map":"office","revision":"7"}`).Msg)
	})
	gateway := startGateway(t, before(server))
	body := strings.NewReader(`{"scope": {"map": "office"}, "point": {"x": 1, "y": 2}}`)
	response, err := http.Post(gateway+queryPoint, "application/json", body)
	if err != nil {
		t.Fatal(err)
	}
	defer response.Body.Close()
	text, err := io.ReadAll(response.Body)
	got := strings.ReplaceAll(string(text), " ", "")
	if err != nil || response.StatusCode != http.StatusOK || got != `{"map":"office","revision":"7"}` {
		t.Errorf("%s %s, error %v", response.Status, text, err)
	}
}

func TestStoppingEndsOpenWatches(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		if err := stream.SendMsg(&message{}); err != nil {
			return err
		}
		<-stream.Context().Done()
		return stream.Context().Err()
	})
	ctx, stop := context.WithCancel(context.Background())
	defer stop()
	cfg := before(server)
	cfg.listen = "127.0.0.1:0"
	cfg.dashboard = t.TempDir()
	ready := make(chan string, 1)
	ended := make(chan error, 1)
	go func() { ended <- run(ctx, cfg, func(url string) { ready <- url }) }()
	stream, err := callers[0].to(<-ready, watch).CallServerStream(testContext(t), raw(""))
	if err != nil {
		t.Fatal(err)
	}
	defer stream.Close()
	if !stream.Receive() {
		t.Fatal(stream.Err())
	}
	stop()
	if stream.Receive() || stream.Err() == nil {
		t.Error("the watch ended without an error")
	}
	if err := <-ended; err != nil {
		t.Error(err)
	}
}
