package main

import (
	"bufio"
	"bytes"
	"compress/gzip"
	"context"
	"errors"
	"fmt"
	"io"
	"math/rand/v2"
	"net"
	"net/http"
	"net/netip"
	"runtime"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/grpc"
	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/status"
	"google.golang.org/protobuf/encoding/protojson"
	"google.golang.org/protobuf/proto"
	"google.golang.org/protobuf/types/dynamicpb"
)

// endBy makes a connection fail when the test has taken too long.
func endBy(t *testing.T, conn net.Conn) {
	t.Helper()
	if err := conn.SetDeadline(time.Now().Add(deadline)); err != nil {
		t.Fatal(err)
	}
}

// inShort returns limits whose times are as short as a loaded machine allows.
func inShort() limits {
	l := defaultLimits()
	l.headerTime, l.idleTime, l.patience, l.pingAfter = time.Second, time.Second, time.Second, time.Second
	return l
}

// untilClosed sends a byte again and again until the gateway has closed the connection, and returns what
// the gateway sent.
func untilClosed(t *testing.T, conn net.Conn, trickle string) string {
	t.Helper()
	if trickle != "" {
		stop := make(chan struct{})
		defer close(stop)
		go func() {
			for {
				select {
				case <-stop:
					return
				case <-time.After(20 * time.Millisecond):
					_, _ = io.WriteString(conn, trickle)
				}
			}
		}()
	}
	text, err := io.ReadAll(conn)
	var late net.Error
	if errors.As(err, &late) && late.Timeout() {
		t.Error("the connection is still open")
	}
	return string(text)
}

func post(path, contentType, headers string) string {
	return "POST " + path + " HTTP/1.1\r\nHost: localhost\r\nContent-Type: " + contentType + "\r\n" + headers + "\r\n"
}

func TestB12_SlowBodiesAreClosed(t *testing.T) {
	server, calls := countingBackend(t)
	cfg := before(server)
	cfg.limits = inShort()
	gateway := startGateway(t, cfg)
	const some, chunked = "Content-Length: 100000\r\n", "Transfer-Encoding: chunked\r\n"
	for name, test := range map[string]struct{ sent, trickle, want string }{
		"silence":         {post(queryPoint, jsonType, some), "", "408"},
		"trickle":         {post(queryPoint, jsonType, some) + "{", " ", "408"},
		"packed":          {post(queryPoint, jsonType, some+"Content-Encoding: gzip\r\n"), "", "408"},
		"chunks":          {post(queryPoint, jsonType, chunked), "1\r\n \r\n", "408"},
		"stream":          {post(watch, streamType, some), "\x00", "200"},
		"message":         {post(watch, streamType, some) + "\x00\x00\x00\x70\x00", "x", "200"},
		"no end":          {post(watch, streamType, some) + "\x00\x00\x00\x00\x00", "", "200"},
		"upload":          {post(importMap, "application/connect+proto", some) + "\x00\x00\x00\x00\x00", "", "200"},
		"no such rpc":     {post("/nothing", jsonType, some), " ", "405"},
		"wrong type":      {post(queryPoint, "text/plain", some), " ", "415"},
		"foreign host":    {strings.Replace(post(queryPoint, jsonType, some), "localhost", "evil.example", 1), " ", "421"},
		"body of a file":  {"GET / HTTP/1.1\r\nHost: localhost\r\n" + some + "\r\n", " ", "404"},
		"expect continue": {post(queryPoint, jsonType, some+"Expect: 100-continue\r\n"), " ", "408"},
	} {
		t.Run(name, func(t *testing.T) {
			t.Parallel()
			conn := dial(t, gateway, "")
			if _, err := io.WriteString(conn, test.sent); err != nil {
				t.Fatal(err)
			}
			answer := untilClosed(t, conn, test.trickle)
			answer = strings.TrimPrefix(answer, "HTTP/1.1 100 Continue\r\n\r\n")
			if !strings.HasPrefix(answer, "HTTP/1.1 "+test.want) {
				t.Errorf("%s", answer)
			}
		})
	}
	t.Cleanup(func() {
		if calls.Load() > 1 { // The upload, whose first message is whole.
			t.Errorf("%d calls reached the server", calls.Load())
		}
	})
}

// The server may answer an upload at its first message. The answer does not wait for the rest.
func TestAnswerBeforeTheEndOfAnUploadIsSentAtOnce(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(string, grpc.ServerStream) error {
		return status.Error(codes.ResourceExhausted, "--max_import_bytes")
	})
	cfg := before(server)
	cfg.limits = inShort()
	cfg.limits.idleTime = deadline
	conn := dial(t, startGateway(t, cfg), "")
	head := post(importMap, "application/connect+proto", "Content-Length: 100000\r\n")
	if _, err := io.WriteString(conn, head+"\x00\x00\x00\x00\x00"); err != nil {
		t.Fatal(err)
	}
	time.Sleep(50 * time.Millisecond) // Until the server's answer has come; an earlier message may be forwarded.
	if _, err := io.WriteString(conn, "\x00\x00\x00\x00\x00"); err != nil {
		t.Fatal(err)
	}
	answer := untilClosed(t, conn, "")
	if !strings.HasPrefix(answer, "HTTP/1.1 200") || !strings.Contains(answer, "--max_import_bytes") {
		t.Errorf("%q", answer)
	}
}

func TestB12_SlowBodiesOfHTTP2AreClosed(t *testing.T) {
	server, _ := countingBackend(t)
	cfg := before(server)
	cfg.limits = inShort()
	gateway := startGateway(t, cfg)
	body, end := io.Pipe()
	defer end.Close()
	request, err := http.NewRequestWithContext(testContext(t), "POST", gateway+queryPoint, body)
	if err != nil {
		t.Fatal(err)
	}
	request.Header.Set("Content-Type", jsonType)
	answer, err := unencrypted(strings.TrimPrefix(gateway, "http://")).client.Do(request)
	if err != nil {
		t.Fatal(err)
	}
	defer answer.Body.Close()
	if answer.StatusCode != http.StatusRequestTimeout {
		t.Error(answer.Status)
	}
}

func TestB12_SlowHeadersAreClosed(t *testing.T) {
	server, _ := countingBackend(t)
	cfg := before(server)
	cfg.limits = inShort()
	gateway := startGateway(t, cfg)
	for name, test := range map[string]struct{ sent, trickle string }{
		"silence":          {"", ""},
		"a line":           {"GET / HTT", ""},
		"headers":          {"GET / HTTP/1.1\r\nHost: localhost\r\nX-A: ", "a"},
		"second request":   {"GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET / HT", ""},
		"half a preface":   {"PRI * HTTP/2.0\r\n\r\nSM", ""},
		"only a preface":   {"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", ""},
		"settings, frame":  {"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00\x00\x04\x00\x00\x00\x00\x00" + "\x00\x40\x00\x01\x04\x00\x00\x00\x01", "a"},
		"settings, header": {"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00\x00\x04\x00\x00\x00\x00\x00" + "\x00\x00\x01\x01\x00\x00\x00\x00\x01\x82", ""},
	} {
		t.Run(name, func(t *testing.T) {
			t.Parallel()
			conn := dial(t, gateway, "")
			if _, err := io.WriteString(conn, test.sent); err != nil {
				t.Fatal(err)
			}
			untilClosed(t, conn, test.trickle)
		})
	}
}

func TestB12_LongHeadersAre431(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	answer, _ := send(t, http.DefaultClient, "GET", gateway+"/", "", map[string]string{"X-Long": strings.Repeat("a", 100_000)})
	if answer.StatusCode != http.StatusRequestHeaderFieldsTooLarge {
		t.Error(answer.Status)
	}
}

// Each limit of time passes while the streams rest: connections of its kind are closed meanwhile.
func TestB12_WatchesAndDialoguesOutliveTheLimitsOfTime(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		if path == observe {
			return echo(path, stream)
		}
		if err := stream.SendMsg(&message{binary: []byte("snapshot")}); err != nil {
			return err
		}
		<-stream.Context().Done()
		return stream.Context().Err()
	})
	proceed := make(chan struct{})
	watched, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		if err := stream.SendMsg(&message{binary: []byte("snapshot")}); err != nil {
			return err
		}
		<-proceed
		return stream.SendMsg(&message{binary: []byte("change")})
	})
	cfg, watchedCfg := before(server), before(watched)
	cfg.limits, watchedCfg.limits = inShort(), inShort()
	gateway, watchedGateway := startGateway(t, cfg), startGateway(t, watchedCfg)

	talk := callers[2].to(gateway, observe).CallBidiStream(testContext(t))
	say := func(word string) {
		if err := talk.Send(raw(word).Msg); err != nil {
			t.Fatal(err)
		}
		if answer, err := talk.Receive(); err != nil || string(answer.binary) != observe+" "+word {
			t.Fatalf("%v, error %v", answer, err)
		}
	}
	say("before")
	streams := map[string]*connect.ServerStreamForClient[message]{}
	for _, as := range callers {
		stream, err := as.to(watchedGateway, watch).CallServerStream(testContext(t), raw("request"))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() {
			t.Fatal(stream.Err())
		}
		streams[as.name] = stream
	}
	for range 3 {
		idle := dial(t, watchedGateway, "")
		if _, err := io.WriteString(idle, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"); err != nil {
			t.Fatal(err)
		}
		untilClosed(t, idle, "")
		slow := dial(t, watchedGateway, "")
		if _, err := io.WriteString(slow, post(queryPoint, jsonType, "Content-Length: 9\r\n")); err != nil {
			t.Fatal(err)
		}
		untilClosed(t, slow, "")
	}
	close(proceed)
	for name, stream := range streams {
		if !stream.Receive() || string(stream.Msg().binary) != "change" || stream.Receive() || stream.Err() != nil {
			t.Errorf("%s: %v", name, stream.Err())
		}
	}
	say("after")
	if err := talk.CloseRequest(); err != nil {
		t.Fatal(err)
	}
}

func TestB12_AnswersThatNobodyReadsAreClosed(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		return stream.SendMsg(&message{binary: make([]byte, 16<<20)})
	})
	cfg := before(server)
	cfg.limits = inShort()
	cfg.limits.bytesPerSecond = 32 << 20
	cfg.limits.maxConnections = 1
	cfg.dashboard = t.TempDir()
	writeFile(t, cfg.dashboard, "large.bin", strings.Repeat("x", 32<<20))
	gateway := startGateway(t, cfg)
	for name, request := range map[string]string{
		"file":   "GET /large.bin HTTP/1.1\r\nHost: localhost\r\n\r\n",
		"answer": post(queryPoint, "application/proto", "Content-Length: 0\r\n"),
	} {
		t.Run(name, func(t *testing.T) {
			var conn net.Conn
			eventually(t, "a connection", func() bool {
				conn = dial(t, gateway, "")
				if !isOpen(conn) {
					return false
				}
				_, err := io.WriteString(conn, request)
				return err == nil
			})
			eventually(t, "the end of a connection whose answer is not read", func() bool {
				other := dial(t, gateway, "")
				defer other.Close()
				return isOpen(other)
			})
		})
	}
}

// isOpen reports whether the gateway answers on the connection.
func isOpen(conn net.Conn) bool {
	if _, err := io.WriteString(conn, "GET /nothing HTTP/1.1\r\nHost: localhost\r\n\r\n"); err != nil {
		return false
	}
	answer, err := http.ReadResponse(bufio.NewReader(conn), nil)
	if err != nil {
		return false
	}
	_, err = io.Copy(io.Discard, answer.Body)
	return err == nil
}

func TestB12_ConnectionsAreBoundedInTotalAndForEachAddress(t *testing.T) {
	server, _ := countingBackend(t)
	cfg := before(server)
	cfg.limits.maxConnections = 6
	cfg.limits.addressShare = 50
	gateway := startGateway(t, cfg)
	open := map[string][]net.Conn{}
	for _, local := range []string{"127.0.0.1", "127.0.0.2", "127.0.0.3"} {
		for range 5 {
			if conn := dial(t, gateway, local); isOpen(conn) {
				open[local] = append(open[local], conn)
			}
		}
	}
	// A half of six, then a half of the three that are left, and of the two that are left then.
	if len(open["127.0.0.1"]) != 3 || len(open["127.0.0.2"]) != 1 || len(open["127.0.0.3"]) != 1 {
		t.Fatalf("%d, %d and %d are open", len(open["127.0.0.1"]), len(open["127.0.0.2"]), len(open["127.0.0.3"]))
	}
	for _, conn := range open["127.0.0.1"] {
		if !isOpen(conn) {
			t.Error("an open connection was closed when there were too many")
		}
		_ = conn.Close()
	}
	eventually(t, "a place for another address", func() bool { return isOpen(dial(t, gateway, "127.0.0.4")) })
}

func TestB12_ConnectionsFitTheOpenFiles(t *testing.T) {
	for descriptors, want := range map[uint64]int64{0: 1, 40: 10, 256: 192, 1024: 960, 1 << 62: 1 << 31} {
		if got := connectionsWithin(descriptors); got != want {
			t.Errorf("%d: %d", descriptors, got)
		}
	}
}

// eventually waits for a condition.
func eventually(t *testing.T, what string, condition func() bool) {
	t.Helper()
	for end := time.Now().Add(deadline); !condition(); time.Sleep(10 * time.Millisecond) {
		if time.Now().After(end) {
			t.Fatalf("in vain: %s", what)
		}
	}
}

func TestB12_CallsAreBounded(t *testing.T) {
	server := startAnswering(t)
	cfg := before(server)
	cfg.limits.maxCalls = 4
	gateway := startGateway(t, cfg)
	ctx, cancel := context.WithCancel(testContext(t))
	for range 2 {
		stream, err := callers[2].to(gateway, watch).CallServerStream(ctx, raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() {
			t.Fatal(stream.Err())
		}
	}
	ask := func() *http.Response {
		answer, _ := send(t, http.DefaultClient, "POST", gateway+queryPoint, "{}", map[string]string{"Content-Type": jsonType})
		return answer
	}
	if answer := ask(); answer.StatusCode != http.StatusServiceUnavailable || answer.Header.Get("Retry-After") == "" {
		t.Errorf("%s %v", answer.Status, answer.Header)
	}
	cancel()
	eventually(t, "an answer after the watches have ended", func() bool { return ask().StatusCode == http.StatusOK })
}

func zipped(t *testing.T, text []byte) []byte {
	t.Helper()
	var packed bytes.Buffer
	packer := gzip.NewWriter(&packed)
	if _, err := packer.Write(text); err != nil {
		t.Fatal(err)
	}
	if err := packer.Close(); err != nil {
		t.Fatal(err)
	}
	return packed.Bytes()
}

func TestB12_LargeBodiesAre413BeforeTheyAreUnpacked(t *testing.T) {
	server, calls := countingBackend(t)
	cfg := before(server)
	cfg.limits.maxBodyBytes = 1 << 20
	gateway := startGateway(t, cfg)
	spaces := bytes.Repeat([]byte(" "), 100<<20)
	bomb := zipped(t, spaces)
	var before, after runtime.MemStats
	runtime.ReadMemStats(&before)
	for name, test := range map[string]struct {
		body     func() io.Reader
		encoding string
	}{
		"declared":  {func() io.Reader { return bytes.NewReader(spaces[:2<<20]) }, ""},
		"in chunks": {func() io.Reader { return io.MultiReader(bytes.NewReader(spaces[:2<<20])) }, ""},
		"packed":    {func() io.Reader { return bytes.NewReader(bomb) }, "gzip"},
	} {
		for _, contentType := range []string{jsonType, "application/proto"} {
			request, err := http.NewRequestWithContext(testContext(t), "POST", gateway+queryPoint, test.body())
			if err != nil {
				t.Fatal(err)
			}
			request.Header.Set("Content-Type", contentType)
			if test.encoding != "" {
				request.Header.Set("Content-Encoding", test.encoding)
			}
			answer, err := http.DefaultClient.Do(request)
			if err != nil {
				t.Fatalf("%s: %v", name, err)
			}
			text, _ := io.ReadAll(answer.Body)
			_ = answer.Body.Close()
			if answer.StatusCode != http.StatusRequestEntityTooLarge || !strings.Contains(string(text), "--max_body_bytes") {
				t.Errorf("%s: %s %s", name, answer.Status, text)
			}
		}
	}
	runtime.ReadMemStats(&after)
	if more := after.TotalAlloc - before.TotalAlloc; more > 64<<20 {
		t.Errorf("%d bytes were allocated", more)
	}
	forEachProtocol(t, func(t *testing.T, as caller) {
		as.options = append(as.options, connect.WithSendGzip())
		request := func() *connect.Request[message] { return connect.NewRequest(&message{binary: spaces[:8<<20]}) }
		_, err := as.to(gateway, queryPoint).CallUnary(testContext(t), request())
		if connect.CodeOf(err) != connect.CodeResourceExhausted {
			t.Errorf("unary: %v", err)
		}
		stream, err := as.to(gateway, watch).CallServerStream(testContext(t), request())
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if stream.Receive() || connect.CodeOf(stream.Err()) != connect.CodeResourceExhausted ||
			!strings.Contains(stream.Err().Error(), "--max_body_bytes") {
			t.Errorf("stream: %v", stream.Err())
		}
	})
	t.Cleanup(func() {
		if calls.Load() != 0 {
			t.Errorf("%d calls reached the server", calls.Load())
		}
	})
}

func TestB12_CompressedMessagesAreForwarded(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", echo)
	gateway := startGateway(t, before(server))
	long := strings.Repeat("hello ", 50_000)
	forEachProtocol(t, func(t *testing.T, as caller) {
		as.options = append(as.options, connect.WithSendGzip())
		for _, text := range []string{"", "short", long} {
			answer, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw(text))
			if err != nil || string(answer.Msg.binary) != queryPoint+" "+text {
				t.Errorf("unary, %d bytes: %v", len(text), err)
			}
			stream, err := as.to(gateway, watch).CallServerStream(testContext(t), raw(text))
			if err != nil {
				t.Fatal(err)
			}
			if !stream.Receive() || string(stream.Msg().binary) != watch+" "+text {
				t.Errorf("stream, %d bytes: %v", len(text), stream.Err())
			}
			_ = stream.Close()
		}
	})
	as := callers[2]
	as.options = append([]connect.ClientOption{connect.WithSendGzip()}, as.options...)
	talk := as.to(gateway, observe).CallBidiStream(testContext(t))
	for _, text := range []string{"one", long, "", "three"} {
		if err := talk.Send(raw(text).Msg); err != nil {
			t.Fatal(err)
		}
		if answer, err := talk.Receive(); err != nil || string(answer.binary) != observe+" "+text {
			t.Fatalf("dialogue: %v", err)
		}
	}
	_ = talk.CloseRequest()
	answer, text := send(t, http.DefaultClient, "POST", gateway+queryPoint, "no gzip at all",
		map[string]string{"Content-Type": jsonType, "Content-Encoding": "gzip"})
	if answer.StatusCode != http.StatusBadRequest || !strings.Contains(text, "gzip") {
		t.Errorf("%s %s", answer.Status, text)
	}
}

func TestB12_BodiesInFlightShareAQuotaOfMemory(t *testing.T) {
	started, proceed := make(chan struct{}, 10), make(chan struct{})
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		started <- struct{}{}
		<-proceed
		return stream.SendMsg(&message{})
	})
	cfg := before(server)
	cfg.limits.maxTotalBodyBytes = 2 * 3 * copiesOfMessage << 20
	gateway := startGateway(t, cfg)
	call := func(as caller, bytes int) error {
		_, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw(strings.Repeat("x", bytes)))
		return err
	}
	held := make(chan error)
	go func() { held <- call(callers[0], 2<<20) }()
	<-started

	body := strings.Repeat("x", 2<<20)
	answer, text := send(t, http.DefaultClient, "POST", gateway+queryPoint, body, map[string]string{"Content-Type": "application/proto"})
	if answer.StatusCode != http.StatusServiceUnavailable || answer.Header.Get("Retry-After") == "" ||
		!strings.Contains(text, "--max_total_body_bytes") {
		t.Errorf("a second body: %s %s %v", answer.Status, text, answer.Header)
	}
	answer, text = send(t, http.DefaultClient, "POST", gateway+queryPoint, body+body, map[string]string{"Content-Type": "application/proto"})
	if answer.StatusCode != http.StatusRequestEntityTooLarge || !strings.Contains(text, "--max_total_body_bytes") {
		t.Errorf("a body that never fits: %s %s", answer.Status, text)
	}
	if err := call(callers[1], 2<<20); connect.CodeOf(err) != connect.CodeResourceExhausted {
		t.Errorf("gRPC-Web: %v", err)
	}
	close(proceed)
	if err := <-held; err != nil {
		t.Error(err)
	}
	for _, as := range callers {
		if err := call(as, 2<<20); err != nil {
			t.Errorf("%s, after the others: %v", as.name, err)
		}
	}
}

// The sum of a stream's messages may exceed what may be in flight.
func TestB12_AnUploadReleasesWhatWasForwarded(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		count := 0
		for {
			var request message
			if err := stream.RecvMsg(&request); errors.Is(err, io.EOF) {
				return stream.SendMsg(&message{binary: fmt.Append(nil, count)})
			} else if err != nil {
				return err
			}
			count += len(request.binary)
		}
	})
	cfg := before(server)
	cfg.limits.maxTotalBodyBytes = 16 << 20
	gateway := startGateway(t, cfg)
	for _, as := range callers {
		upload := as.to(gateway, importMap).CallClientStream(testContext(t))
		for range 40 {
			if err := upload.Send(raw(strings.Repeat("x", 1<<20)).Msg); err != nil {
				t.Fatal(err)
			}
		}
		answer, err := upload.CloseAndReceive()
		if err != nil || string(answer.Msg.binary) != fmt.Sprint(40<<20) {
			t.Errorf("%s: %v, error %v", as.name, answer, err)
		}
	}
}

// A client that opens a dialogue and goes away without a message leaves nothing behind.
func TestB12_ADialogueWithoutMessagesEnds(t *testing.T) {
	opened := make(chan struct{}, 1)
	server, _ := startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		if path == queryPoint {
			return stream.SendMsg(&message{})
		}
		opened <- struct{}{}
		<-stream.Context().Done()
		return stream.Context().Err()
	})
	cfg := before(server)
	cfg.limits.maxCalls = 2 // One for each address.
	gateway := startGateway(t, cfg)
	ctx, cancel := context.WithCancel(testContext(t))
	if err := callers[2].to(gateway, observe).CallBidiStream(ctx).Send(nil); err != nil {
		t.Fatal(err)
	}
	select {
	case <-opened:
	case <-time.After(deadline):
		t.Fatal("the dialogue was not forwarded")
	}
	cancel()
	eventually(t, "a place for another call", func() bool {
		_, err := callers[0].to(gateway, queryPoint).CallUnary(testContext(t), raw(""))
		return err == nil
	})
}

func TestB12_ARefusedMessageOfADialogueSaysWhy(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", echo)
	cfg := before(server)
	cfg.limits.maxBodyBytes = 1000
	gateway := startGateway(t, cfg)
	talk := callers[2].to(gateway, observe).CallBidiStream(testContext(t))
	_ = talk.Send(raw(strings.Repeat("x", 1001)).Msg)
	if _, err := talk.Receive(); connect.CodeOf(err) != connect.CodeResourceExhausted || !strings.Contains(err.Error(), "--max_body_bytes") {
		t.Errorf("got %v", err)
	}
}

// heapWith returns the memory of what make returns.
func heapWith(make func() any) int64 {
	var before, after runtime.MemStats
	runtime.GC()
	runtime.ReadMemStats(&before)
	made := make()
	runtime.GC()
	runtime.ReadMemStats(&after)
	runtime.KeepAlive(made)
	return int64(after.HeapAlloc) - int64(before.HeapAlloc)
}

func TestB12_JSONTakesTheMemoryOfWhatItIsParsedTo(t *testing.T) {
	const many = 50_000
	list := func(element string) string { return strings.Repeat(element+",", many-1) + element }
	pairs := func(value string) string {
		var text strings.Builder
		for i := range many {
			fmt.Fprintf(&text, `"%d":%s,`, i, value)
		}
		return strings.TrimSuffix(text.String(), ",")
	}
	put := func(object string) string {
		return `{"edits":[{"putObject":{"object":{` + object + `}}}]}`
	}
	for name, text := range map[string]string{
		"empty messages":      `{"edits":[` + list(`{}`) + `]}`,
		"messages":            `{"edits":[` + list(`{"putObject":{}}`) + `]}`,
		"nested messages":     `{"edits":[` + list(`{"putObject":{"object":{"shape":{"polygon":{"outer":{"xs":[1]}}}}}}`) + `]}`,
		"numbers":             put(`"shape":{"polygon":{"outer":{"xs":[` + list(`1`) + `]}}}`),
		"long numbers":        put(`"shape":{"polygon":{"outer":{"xs":[` + list(`0.123456789012`) + `]}}}`),
		"strings":             put(`"tags":[` + list(`""`) + `]`),
		"entries of a map":    put(`"classes":{` + pairs("1") + `}`),
		"messages of a map":   put(`"attributes":{` + pairs("{}") + `}`),
		"text":                put(`"label":"` + strings.Repeat("x", 1<<20) + `"`),
		"text with escapes":   put(`"label":"` + strings.Repeat(`\"{,`, 1<<18) + `"`),
		"many spaces, one {}": strings.Repeat(" ", 1<<20) + "{}",
	} {
		var scanner jsonScanner
		taken := int64(len(text)) * copiesOfMessage
		for rest := text; rest != ""; { // In parts of random sizes, as a connection delivers them.
			n := min(len(rest), 1+rand.IntN(1000))
			taken += scanner.parsedBytes([]byte(rest[:n]))
			rest = rest[n:]
		}
		needed := heapWith(func() any {
			parsed := dynamicpb.NewMessage(find(t, "ApplyEditsRequest"))
			if err := protojson.Unmarshal([]byte(text), parsed); err != nil {
				t.Fatalf("%s: %v", name, err)
			}
			encoded, err := proto.Marshal(parsed)
			if err != nil {
				t.Fatal(err)
			}
			return []any{parsed, encoded}
		})
		t.Logf("%s: %d bytes need %d and take %d", name, len(text), needed, taken)
		if needed > taken {
			t.Errorf("%s: %d bytes need %d and take %d", name, len(text), needed, taken)
		}
	}
}

// heldMemory returns the memory that the heap has taken from the system and not returned.
func heldMemory() int64 {
	var memory runtime.MemStats
	runtime.ReadMemStats(&memory)
	return int64(memory.HeapSys) - int64(memory.HeapReleased)
}

func TestB12_MemoryIsReturnedAfterAPeak(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	packed := string(zipped(t, []byte(`{"edits":[`+strings.Repeat("{},", 200_000)+`{}]}`)))
	returnMemory()
	quiet := heldMemory()
	answer, text := send(t, http.DefaultClient, "POST", gateway+"/hypermap.v1.EditService/ApplyEdits", packed,
		map[string]string{"Content-Type": jsonType, "Content-Encoding": "gzip"})
	if answer.StatusCode != http.StatusOK {
		t.Fatalf("%s %s", answer.Status, text)
	}
	eventually(t, "memory returned to the system", func() bool { return heldMemory() < quiet+8<<20 })
}

func TestB12_QuotaAgreesWithASimpleModel(t *testing.T) {
	seed := rand.Uint64()
	t.Logf("seed %d", seed)
	random := rand.New(rand.NewPCG(seed, 0))
	q := newQuota(100, 30)
	taken := map[netip.Addr][]int64{}
	sum := func(addresses ...netip.Addr) (total int64) {
		for _, address := range addresses {
			for _, amount := range taken[address] {
				total += amount
			}
		}
		return total
	}
	var addresses []netip.Addr
	for i := range 5 {
		addresses = append(addresses, netip.AddrFrom4([4]byte{127, 0, 0, byte(i)}))
	}
	for range 10_000 {
		address := addresses[random.IntN(len(addresses))]
		if held := taken[address]; len(held) > 0 && random.IntN(2) == 0 {
			q.release(address, held[0])
			taken[address] = held[1:]
			continue
		}
		amount := random.Int64N(20)
		others := sum(addresses...) - sum(address)
		fits := sum(addresses...)+amount <= 100 && sum(address)+amount <= max((100-others)*30/100, 1)
		if q.take(address, amount) != fits {
			t.Fatalf("%d of %d and %d", amount, sum(address), sum(addresses...))
		}
		if fits {
			taken[address] = append(taken[address], amount)
		}
	}
}

func TestB12_AddressesOfANetworkShare(t *testing.T) {
	for _, same := range [][2]string{
		{"10.0.0.1:1", "10.0.0.1:2"}, {"[::ffff:10.0.0.1]:1", "10.0.0.1:1"},
		{"[2001:db8::1]:1", "[2001:db8::ffff:2]:2"}, {"[fe80::1%eth0]:1", "[fe80::2%eth1]:1"},
	} {
		if addressOf(same[0]) != addressOf(same[1]) {
			t.Errorf("%v", same)
		}
	}
	if addressOf("10.0.0.1:1") == addressOf("10.0.0.2:1") || addressOf("[2001:db8::1]:1") == addressOf("[2001:db8:0:1::1]:1") {
		t.Error("different networks share")
	}
}

func TestB12_LimitsAreFlags(t *testing.T) {
	cfg, err := parseFlags([]string{"--max_connections=7", "--max_calls=8", "--max_body_bytes=9", "--max_total_body_bytes=10", "--address_share=11",
		"--max_watches=12", "--max_message_bytes=13"})
	l := cfg.limits
	if err != nil || l.maxConnections != 7 || l.maxCalls != 8 || l.maxBodyBytes != 9 || l.maxTotalBodyBytes != 10 || l.addressShare != 11 ||
		l.maxWatches != 12 || l.maxMessageBytes != 13 {
		t.Errorf("%+v, error %v", l, err)
	}
	for _, wrong := range []string{"--max_connections=0", "--max_calls=-1", "--max_body_bytes=0", "--max_total_body_bytes=0", "--max_watches=0", "--max_message_bytes=0",
		"--address_share=101"} {
		if _, err := parseFlags([]string{wrong}); err == nil {
			t.Errorf("%s is taken", wrong)
		}
	}
}
