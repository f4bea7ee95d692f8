package main

import (
	"bytes"
	"compress/gzip"
	"context"
	"errors"
	"fmt"
	"io"
	"math/rand/v2"
	"net/http"
	"runtime"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/grpc"
	"google.golang.org/protobuf/encoding/protojson"
	"google.golang.org/protobuf/proto"
	"google.golang.org/protobuf/types/dynamicpb"
)

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
