package main

import (
	"bufio"
	"context"
	"errors"
	"io"
	"math/rand/v2"
	"net"
	"net/http"
	"net/netip"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/grpc"
	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/status"
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
	// The gateway notices the server's answer at a later message; earlier ones may be forwarded.
	answer := untilClosed(t, conn, "\x00\x00\x00\x00\x00")
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

// The names of the rpcs that go on until their caller ends them tell it.
func TestB12_EachWatchIsCounted(t *testing.T) {
	services, err := loadServices()
	if err != nil {
		t.Fatal(err)
	}
	for _, service := range services {
		if !strings.HasPrefix(string(service.FullName()), "hypermap.v1.") {
			continue
		}
		for i := range service.Methods().Len() {
			method := service.Methods().Get(i)
			name := string(method.Name())
			if want := strings.HasPrefix(name, "Watch") || name == "Replicate"; isWatch(method) != want {
				t.Errorf("%s: counted as a watch: %t", method.FullName(), !want)
			}
		}
	}
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
