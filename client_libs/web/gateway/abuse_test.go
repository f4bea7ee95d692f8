package main

import (
	"bufio"
	"context"
	"errors"
	"fmt"
	"io"
	"net"
	"net/http"
	"net/http/httptrace"
	"net/netip"
	"strings"
	"sync"
	"sync/atomic"
	"testing"
	"time"

	"connectrpc.com/connect"
)

const (
	createMap = "/hypermap.v1.CatalogService/CreateMap"
	listMaps  = "/hypermap.v1.CatalogService/ListMaps"
	applyEdit = "/hypermap.v1.EditService/ApplyEdits"
)

// from returns a client of the gateway at another address of this machine, which uses HTTP/2.
func from(local, gateway, path string) *connect.Client[message, message] {
	protocols := new(http.Protocols)
	protocols.SetUnencryptedHTTP2(true)
	dialer := net.Dialer{LocalAddr: &net.TCPAddr{IP: net.ParseIP(local)}}
	client := &http.Client{Transport: &http.Transport{Protocols: protocols, DialContext: dialer.DialContext}}
	return connect.NewClient[message, message](client, gateway+path, connect.WithCodec(binaryCodec{}), connect.WithGRPC())
}

// visitor is a client that must not notice what others do: it has a watch open, asks, and opens watches.
type visitor struct {
	gateway string
	request *connect.Request[message]
	open    *connect.ServerStreamForClient[message]
}

// visit creates a map and watches it.
func visit(t *testing.T, gateway string) *visitor {
	t.Helper()
	_, err := from("127.0.0.1", gateway, createMap).CallUnary(testContext(t), fromJSON(t, "CreateMapRequest", `{"map":"site"}`))
	if err != nil {
		t.Fatal(err)
	}
	v := &visitor{gateway: gateway, request: fromJSON(t, "WatchRequest", `{"scope":{"map":"site"}}`)}
	ctx, cancel := context.WithCancel(context.Background())
	t.Cleanup(cancel)
	if v.open, err = from("127.0.0.1", gateway, watch).CallServerStream(ctx, v.request); err != nil {
		t.Fatal(err)
	}
	if !v.open.Receive() {
		t.Fatal(v.open.Err())
	}
	return v
}

// openWatch opens a watch, waits for its first message and cancels it.
func (v *visitor) openWatch(ctx context.Context, watches *connect.Client[message, message]) error {
	ctx, cancel := context.WithCancel(ctx)
	defer cancel()
	changes, err := watches.CallServerStream(ctx, connect.NewRequest(v.request.Msg))
	if err != nil {
		return err
	}
	defer changes.Close()
	if !changes.Receive() {
		return errors.Join(errors.New("a watch ended"), changes.Err())
	}
	return nil
}

// The ways to make the gateway reset many calls to the server. Each returns a function that makes one.
var storms = map[string]func(v *visitor, local string) func(ctx context.Context){
	"watches": func(v *visitor, local string) func(ctx context.Context) {
		watches := from(local, v.gateway, watch)
		return func(ctx context.Context) {
			if changes, err := watches.CallServerStream(ctx, connect.NewRequest(v.request.Msg)); err == nil {
				changes.Receive()
			}
		}
	},
	// The server answers before the end of the request, which HTTP/2 resets then.
	"wrong uploads": func(v *visitor, local string) func(ctx context.Context) {
		uploads := from(local, v.gateway, importMap)
		const withoutHeader = "\x12\x00" // An empty chunk.
		return func(ctx context.Context) {
			upload := uploads.CallBidiStream(ctx)
			for upload.Send(raw(withoutHeader).Msg) == nil { // The gateway notices the answer at a later message.
				time.Sleep(time.Millisecond)
			}
			_, _ = upload.Receive()
		}
	},
}

func TestB12_StormsOfResetsHarmNobodyElse(t *testing.T) {
	for kind, storm := range storms {
		t.Run(kind+" of one", func(t *testing.T) { endure(t, storm, 1) })
		t.Run(kind+" of eight", func(t *testing.T) { endure(t, storm, 8) })
	}
}

// endure lets a number of addresses attack a gateway, and checks that a visitor does not notice.
func endure(t *testing.T, storm func(v *visitor, local string) func(ctx context.Context), attackers int) {
	const workers = 16
	const duration = 2 * time.Second
	gateway := startGateway(t, before(startServer(t)))
	v := visit(t, gateway)
	ctx, stop := context.WithTimeout(context.Background(), duration)
	defer stop()
	var attack sync.WaitGroup
	defer attack.Wait()
	var attempts atomic.Int64
	for i := range attackers {
		once := storm(v, fmt.Sprintf("127.0.0.%d", 2+i))
		for range workers {
			attack.Add(1)
			go func() {
				defer attack.Done()
				for ; ctx.Err() == nil; attempts.Add(1) {
					call, cancel := context.WithCancel(ctx)
					once(call)
					cancel()
				}
			}()
		}
	}
	asks, watches := from("127.0.0.1", gateway, listMaps), from("127.0.0.1", gateway, watch)
	count, opened := 0, time.Time{}
	for ; ctx.Err() == nil; count++ {
		if _, err := asks.CallUnary(testContext(t), raw("")); err != nil {
			t.Fatalf("call %d: %v", count, err)
		}
		if time.Since(opened) < 250*time.Millisecond {
			continue // The visitor is no storm itself.
		}
		opened = time.Now()
		if err := v.openWatch(testContext(t), watches); err != nil {
			t.Fatalf("after %d calls: %v", count, err)
		}
	}
	attack.Wait()
	if err := v.openWatch(testContext(t), watches); err != nil {
		t.Errorf("after the storm: %v", err)
	}
	t.Logf("%d calls of the visitor, %d of the attackers", count, attempts.Load())
	v.checkStillOpen(t)
}

// checkStillOpen changes the map, and checks that the watch that was opened first tells it.
func (v *visitor) checkStillOpen(t *testing.T) {
	t.Helper()
	_, err := from("127.0.0.1", v.gateway, "/hypermap.v1.CatalogService/CreateLayer").CallUnary(testContext(t),
		fromJSON(t, "CreateLayerRequest", `{"map":"site","layer":{"name":"things","kind":"LAYER_KIND_SEMANTIC"}}`))
	if err != nil {
		t.Fatal(err)
	}
	for told := ""; !strings.Contains(told, "things"); told = toJSON(t, "WatchResponse", v.open.Msg()) {
		if !v.open.Receive() {
			t.Fatalf("the watch ended: %v", v.open.Err())
		}
	}
}

func TestB12_AnAddressThatCancelsTooMuchIsToldToWait(t *testing.T) {
	server := startAnswering(t)
	cfg := before(server)
	cfg.limits.maxCalls = 800
	gateway := startGateway(t, cfg)
	ctx, cancel := context.WithCancel(testContext(t))
	watches := from("127.0.0.2", gateway, watch)
	for range 200 {
		stream, err := watches.CallServerStream(ctx, raw(""))
		if err != nil {
			t.Fatal(err)
		}
		defer stream.Close()
		if !stream.Receive() {
			t.Fatal(stream.Err())
		}
	}
	cancel()
	asks := from("127.0.0.2", gateway, queryPoint)
	ask := func() error {
		_, err := asks.CallUnary(testContext(t), raw(""))
		return err
	}
	eventually(t, "a refusal", func() bool { return ask() != nil })
	conn := dial(t, gateway, "127.0.0.2")
	if _, err := io.WriteString(conn, post(queryPoint, jsonType, "Content-Length: 0\r\n")); err != nil {
		t.Fatal(err)
	}
	answer, err := http.ReadResponse(bufio.NewReader(conn), nil)
	if err != nil {
		t.Fatal(err)
	}
	text, _ := io.ReadAll(answer.Body)
	if answer.StatusCode != http.StatusTooManyRequests || answer.Header.Get("Retry-After") == "" ||
		!strings.Contains(string(text), "resource_exhausted") {
		t.Errorf("%s %s %v", answer.Status, text, answer.Header)
	}
	if _, err := from("127.0.0.1", gateway, queryPoint).CallUnary(testContext(t), raw("")); err != nil {
		t.Errorf("another address: %v", err)
	}
	eventually(t, "an answer after a while", func() bool { return ask() == nil })
}

// hypermapd counts the bytes of messages that it was not given against the connection, and shuts it down
// after 256 MiB.
func TestB12_LargeRequestsThatAreGivenUpHarmNobodyElse(t *testing.T) {
	const number = 160
	gateway := startGateway(t, before(startServer(t)))
	v := visit(t, gateway)
	edits := from("127.0.0.2", gateway, applyEdit)
	large := &message{binary: make([]byte, 15<<20)}
	for i := range number {
		ctx, cancel := context.WithCancel(testContext(t))
		// When the gateway has the request, and sends it.
		ctx = httptrace.WithClientTrace(ctx, &httptrace.ClientTrace{WroteRequest: func(httptrace.WroteRequestInfo) {
			time.AfterFunc(time.Duration(i%16)*time.Millisecond, cancel)
		}})
		_, _ = edits.CallUnary(ctx, connect.NewRequest(large)) // May fail or not.
		cancel()
	}
	eventually(t, "an answer to the attacker", func() bool {
		_, err := from("127.0.0.2", gateway, listMaps).CallUnary(testContext(t), raw(""))
		return err == nil
	})
	v.checkStillOpen(t)
}

func TestB12_ResetsTakeTurns(t *testing.T) {
	pacer := newResetPacer()
	busy, quiet := netip.MustParseAddr("127.0.0.2"), netip.MustParseAddr("127.0.0.3")
	began := time.Now()
	var turns sync.WaitGroup
	for range 30 {
		turns.Add(1)
		go func() {
			defer turns.Done()
			pacer.wait(busy, nil)
		}()
	}
	eventually(t, "calls that wait", func() bool { return pacer.waiting(busy) > 20 })
	if !pacer.wait(quiet, nil) {
		t.Error("no turn")
	}
	if pacer.waiting(busy) == 0 {
		t.Error("the quiet address waited for all calls of the busy one")
	}
	ended := make(chan struct{})
	close(ended)
	pacer.wait(quiet, ended)
	if pacer.waiting(quiet) != 0 {
		t.Error("a call that has ended waits")
	}
	turns.Wait()
	if least := time.Duration(30-resetBurst) * time.Second / resetsPerSecond; time.Since(began) < least {
		t.Errorf("30 turns took %v, and not %v", time.Since(began), least)
	}
}

func TestB12_ResetsDoNotDelayTheEndOfTheGateway(t *testing.T) {
	const number = 4 * resetsPerSecond * int(deadline/time.Second)
	pacer := newResetPacer()
	address := netip.MustParseAddr("127.0.0.2")
	done := make(chan struct{})
	go func() {
		defer close(done)
		var turns sync.WaitGroup
		for range number {
			turns.Add(1)
			go func() {
				defer turns.Done()
				pacer.wait(address, nil)
			}()
		}
		turns.Wait()
	}()
	eventually(t, "calls that wait", func() bool { return pacer.waiting(address) > 0 })
	pacer.stop()
	select {
	case <-done:
	case <-time.After(deadline):
		t.Error("calls still wait")
	}
}

func TestB12_MessagesAboveTheServersLimitDoNotReachIt(t *testing.T) {
	gateway := startGateway(t, before(startServer(t)))
	v := visit(t, gateway)
	edits := from("127.0.0.2", gateway, applyEdit)
	large := raw(strings.Repeat("x", 17<<20))
	for range 30 {
		_, err := edits.CallUnary(testContext(t), connect.NewRequest(large.Msg))
		if connect.CodeOf(err) != connect.CodeResourceExhausted || !strings.Contains(err.Error(), "--max_message_bytes") {
			t.Fatal(err)
		}
	}
	v.checkStillOpen(t)
}

func TestB12_TheLimitOfAMessageHoldsForAllFormats(t *testing.T) {
	server, calls := countingBackend(t)
	cfg := before(server)
	cfg.limits.maxMessageBytes = 1000
	gateway := startGateway(t, cfg)
	label := strings.Repeat("x", 1000)
	for contentType, body := range map[string]string{
		"application/proto": label + "x",
		jsonType:            `{"edits":[{"putObject":{"object":{"label":"` + label + `"}}}]}`,
	} {
		answer, text := send(t, http.DefaultClient, "POST", gateway+applyEdit, body, map[string]string{"Content-Type": contentType})
		if answer.StatusCode != http.StatusRequestEntityTooLarge || !strings.Contains(text, "--max_message_bytes") {
			t.Errorf("%s: %s %s", contentType, answer.Status, text)
		}
	}
	for _, as := range callers {
		upload := as.to(gateway, importMap).CallClientStream(testContext(t))
		_ = upload.Send(raw(label + "x").Msg)
		if _, err := upload.CloseAndReceive(); connect.CodeOf(err) != connect.CodeResourceExhausted {
			t.Errorf("%s: %v", as.name, err)
		}
	}
	if calls.Load() != 0 {
		t.Errorf("%d calls reached the server", calls.Load())
	}
	if _, err := callers[0].to(gateway, queryPoint).CallUnary(testContext(t), raw(label)); err != nil {
		t.Errorf("a message of the largest size: %v", err)
	}
}
