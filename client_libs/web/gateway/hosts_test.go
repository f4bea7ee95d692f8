package main

import (
	"bytes"
	"context"
	"io"
	"net"
	"net/http"
	"strings"
	"sync/atomic"
	"testing"

	"google.golang.org/grpc"
)

const deleteMap = "/hypermap.v1.CatalogService/DeleteMap"

// countingBackend starts a fake server that counts calls and answers each with an empty message.
func countingBackend(t *testing.T) (string, *atomic.Int64) {
	t.Helper()
	var calls atomic.Int64
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		calls.Add(1)
		return stream.SendMsg(&message{})
	})
	return server, &calls
}

// send sends a request with the headers, of which Host is one, and returns the answer and its text.
func send(t *testing.T, client *http.Client, method, url, body string, headers map[string]string) (*http.Response, string) {
	t.Helper()
	request, err := http.NewRequestWithContext(testContext(t), method, url, strings.NewReader(body))
	if err != nil {
		t.Fatal(err)
	}
	for name, value := range headers {
		if name == "Host" {
			request.Host = value
		} else {
			request.Header.Set(name, value)
		}
	}
	response, err := client.Do(request)
	if err != nil {
		t.Fatal(err)
	}
	defer response.Body.Close()
	text, err := io.ReadAll(response.Body)
	if err != nil {
		t.Fatal(err)
	}
	return response, string(text)
}

// bothHTTP runs the test with a client of HTTP/1 and one of HTTP/2.
func bothHTTP(t *testing.T, gateway string, test func(t *testing.T, client *http.Client)) {
	t.Run("HTTP1", func(t *testing.T) { test(t, http.DefaultClient) })
	t.Run("HTTP2", func(t *testing.T) { test(t, unencrypted(strings.TrimPrefix(gateway, "http://")).client) })
}

const jsonType, streamType = "application/json", "application/grpc-web+proto"

func TestD_RebindingHostIsRefused(t *testing.T) {
	server, calls := countingBackend(t)
	gateway := startGateway(t, before(server))
	bothHTTP(t, gateway, func(t *testing.T, client *http.Client) {
		for _, host := range []string{
			"evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example", "192.0.2.1",
			"[2001:db8::1]:80", "0.0.0.0",
		} {
			headers := map[string]string{"Host": host, "Origin": "http://" + host, "Content-Type": jsonType}
			answer, text := send(t, client, "POST", gateway+deleteMap, `{"map":"office"}`, headers)
			if answer.StatusCode != http.StatusMisdirectedRequest || !strings.Contains(text, "--allowed_host") {
				t.Errorf("%s: %s %s", host, answer.Status, text)
			}
			headers["Content-Type"] = streamType
			answer, _ = send(t, client, "POST", gateway+watch, "\x00\x00\x00\x00\x00", headers)
			if answer.StatusCode != http.StatusMisdirectedRequest ||
				!strings.Contains(answer.Header.Get("Grpc-Message"), "--allowed_host") {
				t.Errorf("%s: a stream gets %s %v", host, answer.Status, answer.Header)
			}
			if answer, _ := send(t, client, "GET", gateway+"/", "", headers); answer.StatusCode != http.StatusMisdirectedRequest {
				t.Errorf("%s: a file gets %s", host, answer.Status)
			}
		}
	})
	if calls.Load() != 0 {
		t.Errorf("%d calls reached the server", calls.Load())
	}
}

func TestD_ForeignOriginIsRefused(t *testing.T) {
	server, calls := countingBackend(t)
	gateway := startGateway(t, before(server))
	bothHTTP(t, gateway, func(t *testing.T, client *http.Client) {
		for _, origin := range []string{
			"http://evil.example", "https://evil.example", "null", "", "http://localhost.evil.example",
			"http://127.0.0.1:1", "chrome-extension://abc", "file://127.0.0.1",
		} {
			for path, contentType := range map[string]string{deleteMap: jsonType, watch: streamType} {
				headers := map[string]string{"Origin": origin, "Content-Type": contentType}
				answer, _ := send(t, client, "POST", gateway+path, "{}", headers)
				if answer.StatusCode != http.StatusForbidden || answer.Header.Get("Access-Control-Allow-Origin") != "" {
					t.Errorf("%q: %s gets %s %v", origin, path, answer.Status, answer.Header)
				}
			}
			preflight := map[string]string{"Origin": origin, "Access-Control-Request-Method": "POST"}
			answer, text := send(t, client, "OPTIONS", gateway+deleteMap, "", preflight)
			if answer.StatusCode != http.StatusForbidden || !strings.Contains(text, "--allowed_host") {
				t.Errorf("%q: a preflight gets %s %s", origin, answer.Status, text)
			}
		}
	})
	if calls.Load() != 0 {
		t.Errorf("%d calls reached the server", calls.Load())
	}
}

func TestD_RequestsOfItsOwnPagesAndOfProgramsGoOn(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	_, port, _ := net.SplitHostPort(strings.TrimPrefix(gateway, "http://"))
	bothHTTP(t, gateway, func(t *testing.T, client *http.Client) {
		for _, headers := range []map[string]string{
			{},
			{"Origin": gateway},
			{"Host": "localhost:" + port, "Origin": "http://localhost:" + port},
			{"Host": "LocalHost.:" + port},
			{"Host": "[::1]:" + port},
			// A tunnel has a port of its own, and may have the default port.
			{"Host": "localhost:9000", "Origin": "http://localhost:9000"},
			{"Host": "localhost", "Origin": "http://localhost"},
		} {
			headers["Content-Type"] = jsonType
			answer, text := send(t, client, "POST", gateway+deleteMap, `{"map":"office"}`, headers)
			if answer.StatusCode != http.StatusOK {
				t.Errorf("%v: %s %s", headers, answer.Status, text)
			}
		}
	})
}

func TestD_PagesOfAllowedHostsMayCallAndReadAnswers(t *testing.T) {
	server, _ := countingBackend(t)
	for flag, origins := range map[string][]string{
		"app.example":           {"http://app.example", "https://app.example:8443"},
		"x.example,app.example": {"http://app.example"},
		"app.example:443":       {"https://app.example"},
		"localhost:5173":        {"http://localhost:5173"},
		"*":                     {"http://evil.example", "null"},
	} {
		cfg := before(server)
		if err := cfg.allowed.add(flag); err != nil {
			t.Fatal(err)
		}
		gateway := startGateway(t, cfg)
		for _, origin := range origins {
			answer, _ := send(t, http.DefaultClient, "OPTIONS", gateway+deleteMap, "",
				map[string]string{"Origin": origin, "Access-Control-Request-Method": "POST"})
			if answer.StatusCode != http.StatusNoContent || answer.Header.Get("Access-Control-Allow-Origin") != origin ||
				!strings.Contains(answer.Header.Get("Access-Control-Allow-Headers"), "Authorization") {
				t.Errorf("--allowed_host=%s, %s: the preflight gets %s %v", flag, origin, answer.Status, answer.Header)
			}
			answer, text := send(t, http.DefaultClient, "POST", gateway+deleteMap, `{"map":"office"}`,
				map[string]string{"Origin": origin, "Content-Type": jsonType})
			if answer.StatusCode != http.StatusOK || answer.Header.Get("Access-Control-Allow-Origin") != origin ||
				!strings.Contains(strings.Join(answer.Header.Values("Vary"), ","), "Origin") {
				t.Errorf("--allowed_host=%s, %s: %s %s %v", flag, origin, answer.Status, text, answer.Header)
			}
		}
	}
}

func TestD_HostsFollowFromTheAddressAndTheFlag(t *testing.T) {
	for _, test := range []struct {
		listen, bound, flag string
		own, foreign        []string
	}{
		{"127.0.0.1:8080", "127.0.0.1:8080", "", []string{"127.0.0.1:8080", "localhost", "127.0.0.2"}, []string{"10.0.0.1", "a.example", ""}},
		{"10.0.0.1:80", "10.0.0.1:80", "", []string{"10.0.0.1", "10.0.0.1:99"}, []string{"10.0.0.2", "localhost", "127.0.0.1"}},
		{"robot.lan:80", "10.0.0.1:80", "", []string{"robot.lan", "Robot.Lan.:80", "10.0.0.1"}, []string{"lan", "x.robot.lan"}},
		{":80", "[::]:80", "", []string{"10.0.0.2:80", "[fe80::1]", "localhost"}, []string{"a.example", "10.0.0.2.a.example", "a b", "["}},
		{"127.0.0.1:80", "127.0.0.1:80", "a.example,b.example:81", []string{"a.example", "A.example:7", "b.example:81"}, []string{"b.example", "b.example:80"}},
		{"127.0.0.1:80", "127.0.0.1:80", "b.example:443", []string{"b.example", "b.example:443"}, []string{"b.example:80"}},
		{"127.0.0.1:80", "127.0.0.1:80", "*", []string{"evil.example", ""}, nil},
	} {
		var allowed allowedHosts
		if test.flag != "" {
			if err := allowed.add(test.flag); err != nil {
				t.Fatal(err)
			}
		}
		bound, err := net.ResolveTCPAddr("tcp", test.bound)
		if err != nil {
			t.Fatal(err)
		}
		h := newHosts(allowed, test.listen, bound)
		for _, host := range test.own {
			if !h.isOwn(host) {
				t.Errorf("%+v: %q is refused", test, host)
			}
		}
		for _, host := range test.foreign {
			if h.isOwn(host) {
				t.Errorf("%+v: %q is not refused", test, host)
			}
		}
	}
}

func TestD_AllowedHostIsRepeatableAndRefusesWhatIsNoHost(t *testing.T) {
	cfg, err := parseFlags([]string{"--allowed_host=a.example, b.example:8443", "--allowed_host", "C.example"})
	if err != nil {
		t.Fatal(err)
	}
	want := []hostPort{{"a.example", ""}, {"b.example", "8443"}, {"c.example", ""}}
	if got := cfg.allowed.hosts; len(got) != 3 || got[0] != want[0] || got[1] != want[1] || got[2] != want[2] || cfg.allowed.all {
		t.Errorf("%+v", cfg.allowed)
	}
	for _, wrong := range []string{"", "https://a.example", "a.example/", "a.example:x", "*.example", "größe.example", "a,,b"} {
		var allowed allowedHosts
		if allowed.add(wrong) == nil {
			t.Errorf("%q is taken as %+v", wrong, allowed)
		}
	}
}

// A page that HTTPS protects must not be called by one that anybody on the network can change.
func TestD_APageWithoutTLSIsForeignToAGatewayWithTLS(t *testing.T) {
	server, _ := countingBackend(t)
	pair := makeCertificate(t)
	cfg := before(server)
	cfg.tlsCert, cfg.tlsKey = pair.certFile, pair.keyFile
	gateway := startGateway(t, cfg)
	for origin, want := range map[string]int{
		gateway: http.StatusOK,
		strings.Replace(gateway, "https", "http", 1): http.StatusForbidden,
	} {
		answer, _ := send(t, trusting(t, pair), "POST", gateway+deleteMap, "{}",
			map[string]string{"Origin": origin, "Content-Type": jsonType})
		if answer.StatusCode != want {
			t.Errorf("%s: %s", origin, answer.Status)
		}
	}
}

func TestD_TheCharacterSetUTF8IsAccepted(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		return stream.SendMsg(fromJSON(t, "QueryPointResponse", `{"map":"office"}`).Msg)
	})
	gateway := startGateway(t, before(server))
	for _, contentType := range []string{
		"application/json", "application/json; charset=utf-8", "application/json;charset=UTF-8",
		`application/json; charset="utf-8"`, "application/json; charset=utf8", "Application/JSON; Charset=Utf-8",
		"application/json; profile=x",
	} {
		answer, text := send(t, http.DefaultClient, "POST", gateway+queryPoint, `{"scope":{"map":"größe"}}`,
			map[string]string{"Content-Type": contentType})
		if answer.StatusCode != http.StatusOK || !strings.Contains(text, "office") {
			t.Errorf("%s: %s %s", contentType, answer.Status, text)
		}
	}
	stream, _ := send(t, http.DefaultClient, "POST", gateway+watch, "\x00\x00\x00\x00\x02{}",
		map[string]string{"Content-Type": "application/connect+json; charset=utf-8"})
	if stream.StatusCode != http.StatusOK {
		t.Errorf("a stream: %s", stream.Status)
	}
}

func TestD_OtherMediaTypesAre415(t *testing.T) {
	server, calls := countingBackend(t)
	gateway := startGateway(t, before(server))
	for _, contentType := range []string{
		"", "text/plain", "text/plain; charset=utf-8", "application/x-www-form-urlencoded", "multipart/form-data",
		"application/json; charset=utf-16", "application/json; charset=latin1", "application/xml", "json", ";",
	} {
		answer, text := send(t, http.DefaultClient, "POST", gateway+queryPoint, "{}", map[string]string{"Content-Type": contentType})
		if answer.StatusCode != http.StatusUnsupportedMediaType {
			t.Errorf("%q: %s %s", contentType, answer.Status, text)
		}
	}
	if calls.Load() != 0 {
		t.Errorf("%d calls reached the server", calls.Load())
	}
}

func TestD_PathsThatNoFileCanHaveAreNotFound(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	for _, path := range []string{
		"/assets/%00", "/%00", "/a%00.js", "/%ff%fe", "/" + strings.Repeat("a", 300), "/" + strings.Repeat("a/", 1500),
		"/%5c..%5csecret", "/nothing", "/",
	} {
		if answer, _ := send(t, http.DefaultClient, "GET", gateway+path, "", nil); answer.StatusCode != http.StatusNotFound {
			t.Errorf("%.40s: %s", path, answer.Status)
		}
	}
}

func TestD_LongPathsAre414(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	bothHTTP(t, gateway, func(t *testing.T, client *http.Client) {
		for _, method := range []string{"GET", "POST"} {
			for _, path := range []string{strings.Repeat("a", 9000), strings.Repeat("a/", 4500), strings.Repeat("%00", 3000)} {
				if answer, _ := send(t, client, method, gateway+"/"+path, "", nil); answer.StatusCode != http.StatusRequestURITooLong {
					t.Errorf("%s %.10s: %s", method, path, answer.Status)
				}
			}
		}
	})
}

// Requests for "*" have no path that a handler is chosen by.
func TestD_RequestsForNoPathAreChecked(t *testing.T) {
	server, _ := countingBackend(t)
	gateway := startGateway(t, before(server))
	conn := dial(t, gateway, "")
	if _, err := io.WriteString(conn, "OPTIONS * HTTP/1.1\r\nHost: evil.example\r\n\r\n"); err != nil {
		t.Fatal(err)
	}
	answer := make([]byte, 12)
	if _, err := io.ReadFull(conn, answer); err != nil || !bytes.Equal(answer, []byte("HTTP/1.1 421")) {
		t.Errorf("%s, error %v", answer, err)
	}
}

// dial connects to the gateway, from a local address if one is given. Reading ends after the deadline of tests.
func dial(t *testing.T, gateway, local string) net.Conn {
	t.Helper()
	dialer := net.Dialer{}
	if local != "" {
		dialer.LocalAddr = &net.TCPAddr{IP: net.ParseIP(local)}
	}
	conn, err := dialer.DialContext(context.Background(), "tcp", strings.TrimPrefix(gateway, "http://"))
	if err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { _ = conn.Close() })
	endBy(t, conn)
	return conn
}
