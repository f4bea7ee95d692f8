package main

import (
	"errors"
	"flag"
	"fmt"
	"net"
	"net/http"
	"time"
)

const (
	// maxHeaderBytes bounds the headers of a request, including its path.
	maxHeaderBytes = 32 << 10
	// maxPathBytes is more than the path of any rpc or file has.
	maxPathBytes = 4096
	// maxStreams is the number of calls that an HTTP/2 connection may have at once.
	maxStreams = 100
	// streamBufferBytes is the receive buffer of one stream from the server. The HTTP/2 connection buffers as
	// much for each call of the default of --max_calls, so that clients which do not read can't stop others.
	streamBufferBytes = 512 << 10
	// uploadBufferBytes bounds what is buffered of the request bodies of an HTTP/2 connection.
	uploadBufferBytes = 256 << 10
)

// limits bounds what clients can ask of the gateway.
type limits struct {
	maxConnections int64
	// Requests of all kinds.
	maxCalls   int64
	maxWatches int64
	// A message in the format of Protobuf. Must not be above hypermapd's limit: gRPC refuses larger messages
	// without telling hypermapd, which counts their bytes against the connection of all browsers.
	maxMessageBytes int64
	// A body, or a message of a stream, after unpacking.
	maxBodyBytes int64
	// Memory for the bodies and answers of all calls together.
	maxTotalBodyBytes int64
	// The part of maxConnections, maxCalls, maxWatches and maxTotalBodyBytes that one address may have of what
	// the others leave, in percent.
	addressShare int64

	// Time for the headers of a request, and for the handshake of TLS.
	headerTime time.Duration
	// Time between two requests of a connection, or between two messages of an upload.
	idleTime time.Duration
	// A body may take patience, and a second for each bytesPerSecond. The same holds for answers that are
	// not streams.
	patience       time.Duration
	bytesPerSecond int64
	// Time after which an HTTP/2 client that sends nothing is asked for a sign of life.
	pingAfter time.Duration
}

func defaultLimits() limits {
	return limits{
		maxConnections:    1024,
		maxCalls:          2048,
		maxWatches:        500,
		maxMessageBytes:   16 << 20,
		maxBodyBytes:      32 << 20,
		maxTotalBodyBytes: 512 << 20,
		addressShare:      50,
		headerTime:        10 * time.Second,
		idleTime:          2 * time.Minute,
		patience:          20 * time.Second,
		bytesPerSecond:    32 << 10,
		pingAfter:         30 * time.Second,
	}
}

func (l *limits) addFlags(flags *flag.FlagSet) {
	flags.Int64Var(&l.maxConnections, "max_connections", l.maxConnections,
		"most connections at once, a `NUMBER`; further ones are closed at once")
	flags.Int64Var(&l.maxCalls, "max_calls", l.maxCalls,
		"most requests at once, watches and files included, a `NUMBER`; further ones get 503")
	flags.Int64Var(&l.maxWatches, "max_watches", l.maxWatches,
		"most watches and replicas at once, a `NUMBER`; further ones get 503. No more than half of --max_watchers of hypermapd")
	flags.Int64Var(&l.maxMessageBytes, "max_message_bytes", l.maxMessageBytes,
		"largest message to the server, encoded as Protobuf, in `BYTES`; larger ones get 413.\n"+
			"It must not exceed --max_message_bytes of hypermapd, which would otherwise shut down the connection that all browsers share")
	flags.Int64Var(&l.maxBodyBytes, "max_body_bytes", l.maxBodyBytes,
		"largest body of a call, or message of a stream, unpacked, in `BYTES`; larger ones get 413")
	flags.Int64Var(&l.maxTotalBodyBytes, "max_total_body_bytes", l.maxTotalBodyBytes,
		"most memory for the bodies and answers of all calls together, in `BYTES`; each takes some four times its size,\n"+
			"in JSON ten times or more; calls that exceed it get 503, or 413 if their body always would")
	flags.Int64Var(&l.addressShare, "address_share", l.addressShare,
		"part of --max_connections, --max_calls, --max_watches and --max_total_body_bytes that one address may have\n"+
			"of what others leave, in `PERCENT`; 100 behind a proxy, from which all calls come")
}

func (l *limits) check() error {
	for _, flag := range []struct {
		name  string
		value int64
	}{
		{"max_connections", l.maxConnections},
		{"max_calls", l.maxCalls},
		{"max_watches", l.maxWatches},
		{"max_message_bytes", l.maxMessageBytes},
		{"max_body_bytes", l.maxBodyBytes},
		{"max_total_body_bytes", l.maxTotalBodyBytes},
	} {
		if flag.value < 1 {
			return fmt.Errorf("--%s must be at least 1", flag.name)
		}
	}
	if l.addressShare < 1 || l.addressShare > 100 {
		return errors.New("--address_share must be from 1 to 100")
	}
	return nil
}

// timeFor returns how long an amount of bytes may take.
func (l *limits) timeFor(bytes int64) time.Duration {
	return l.patience + time.Duration(bytes/l.bytesPerSecond)*time.Second
}

// newServer returns an HTTP server whose connections are bounded in time. Neither ReadTimeout nor the
// other times end a call whose body has arrived, so a watch may go on as long as it likes.
func (l *limits) newServer(handler http.Handler) *http.Server {
	return &http.Server{
		Handler:           handler,
		Protocols:         protocols(),
		MaxHeaderBytes:    maxHeaderBytes,
		ReadHeaderTimeout: l.headerTime,
		// Bounds bodies that no handler reads. requestBody sets deadlines of its own.
		ReadTimeout: l.headerTime + l.patience,
		IdleTimeout: l.idleTime,
		// Requests for "*" go through the checks of the handler, too.
		DisableGeneralOptionsHandler: true,
		HTTP2: &http.HTTP2Config{
			MaxConcurrentStreams:          maxStreams,
			MaxReceiveBufferPerConnection: uploadBufferBytes,
			MaxReceiveBufferPerStream:     uploadBufferBytes,
			SendPingTimeout:               l.pingAfter,
			PingTimeout:                   l.patience,
		},
	}
}

// protocols returns HTTP/1 and HTTP/2 for browsers, and HTTP/2 without TLS for gRPC clients.
func protocols() *http.Protocols {
	var p http.Protocols
	p.SetHTTP1(true)
	p.SetHTTP2(true)
	p.SetUnencryptedHTTP2(true)
	return &p
}

func limitPath(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if len(r.URL.EscapedPath()) > maxPathBytes {
			http.Error(w, fmt.Sprintf("a path may have %d bytes", maxPathBytes), http.StatusRequestURITooLong)
			return
		}
		next.ServeHTTP(w, r)
	})
}

// answerWriter bounds the time in which a client must take an answer. It is not for streams, whose clients
// may be as slow as they like.
type answerWriter struct {
	http.ResponseWriter
	limits *limits

	begun   time.Time
	written int64
}

// allow sets the deadline for the bytes that have been written and this many more.
func (w *answerWriter) allow(more int) {
	if w.begun.IsZero() {
		w.begun = time.Now()
	}
	w.written += int64(more)
	// A writer without deadlines is one of a test.
	_ = http.NewResponseController(w.ResponseWriter).SetWriteDeadline(w.begun.Add(w.limits.timeFor(w.written)))
}

func (w *answerWriter) WriteHeader(status int) {
	w.allow(0)
	w.ResponseWriter.WriteHeader(status)
}

func (w *answerWriter) Write(data []byte) (int, error) {
	w.allow(len(data))
	return w.ResponseWriter.Write(data)
}

func (w *answerWriter) Flush() { _ = http.NewResponseController(w.ResponseWriter).Flush() }

func (w *answerWriter) Unwrap() http.ResponseWriter { return w.ResponseWriter }

// listen returns a listener on the address with bounded connections.
func (l *limits) listen(address string) (*boundedListener, error) {
	listener, err := net.Listen("tcp", address)
	if err != nil {
		return nil, err
	}
	return boundConnections(listener.(*net.TCPListener), *l), nil
}
