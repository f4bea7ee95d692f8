package main

import (
	"bytes"
	"context"
	"net"
	"net/http"
	"os"
	"path/filepath"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/grpc"
	"google.golang.org/grpc/credentials"
	"google.golang.org/protobuf/reflect/protoreflect"
)

// deadline ends tests that hang. No call takes this long otherwise.
const deadline = 30 * time.Second

const (
	queryPoint = "/hypermap.v1.QueryService/QueryPoint"
	watch      = "/hypermap.v1.WatchService/Watch"
	importMap  = "/hypermap.v1.CatalogService/ImportMap"
	observe    = "/hypermap.v1.IngestService/Observe"
)

// answer implements all methods of a fake server.
type answer func(path string, stream grpc.ServerStream) error

// startBackend starts a fake server with another implementation of gRPC than the gateway's, and returns
// its address.
func startBackend(t *testing.T, address string, play answer, options ...grpc.ServerOption) (string, *grpc.Server) {
	t.Helper()
	listener, err := net.Listen("tcp", address)
	if err != nil {
		t.Fatal(err)
	}
	options = append(options, grpc.ForceServerCodec(binaryCodec{}),
		grpc.UnknownServiceHandler(func(_ any, stream grpc.ServerStream) error {
			path, _ := grpc.MethodFromServerStream(stream)
			return play(path, stream)
		}))
	server := grpc.NewServer(options...)
	go func() { _ = server.Serve(listener) }()
	t.Cleanup(server.Stop)
	return listener.Addr().String(), server
}

func withTLS(pair keyPair) grpc.ServerOption {
	credentials, err := credentials.NewServerTLSFromFile(pair.certFile, pair.keyFile)
	if err != nil {
		panic(err)
	}
	return grpc.Creds(credentials)
}

// startGateway starts the gateway like main does, and returns its URL.
func startGateway(t *testing.T, cfg config) string {
	t.Helper()
	if cfg.dashboard == "" {
		cfg.dashboard = t.TempDir()
	}
	if cfg.listen == "" {
		cfg.listen = "127.0.0.1:0"
	}
	if cfg.limits == (limits{}) {
		cfg.limits = defaultLimits()
	}
	ctx, stop := context.WithCancel(context.Background())
	ready := make(chan string, 1)
	ended := make(chan error, 1)
	go func() { ended <- run(ctx, cfg, func(url string) { ready <- url }) }()
	t.Cleanup(func() {
		stop()
		if err := <-ended; err != nil {
			t.Errorf("the gateway ended with: %v", err)
		}
	})
	select {
	case url := <-ready:
		return url
	case err := <-ended:
		ended <- nil
		t.Fatalf("the gateway did not start: %v", err)
	case <-time.After(deadline):
		t.Fatal("the gateway is not ready")
	}
	return ""
}

// before returns the configuration of a gateway in front of a server.
func before(server string) config {
	return config{upstream: upstreamConfig{address: server}, limits: defaultLimits()}
}

// caller is a client that uses one of the protocols.
type caller struct {
	name    string
	options []connect.ClientOption
}

var callers = []caller{
	{"Connect", nil},
	{"GRPCWeb", []connect.ClientOption{connect.WithGRPCWeb()}},
	{"GRPC", []connect.ClientOption{connect.WithGRPC()}},
}

// forEachProtocol runs the test for each protocol of the gateway.
func forEachProtocol(t *testing.T, test func(t *testing.T, as caller)) {
	for _, as := range callers {
		t.Run(as.name, func(t *testing.T) {
			t.Parallel()
			test(t, as)
		})
	}
}

// to returns a client for a method of the gateway. Without TLS it uses HTTP/1.1 like browsers, except
// for gRPC, which needs HTTP/2.
func (c caller) to(gateway, path string) *connect.Client[message, message] {
	client := http.DefaultClient
	if c.name == "GRPC" {
		client = unencrypted(strings.TrimPrefix(gateway, "http://")).client
	}
	options := append([]connect.ClientOption{connect.WithCodec(binaryCodec{})}, c.options...)
	return connect.NewClient[message, message](client, gateway+path, options...)
}

func unencrypted(address string) *upstream {
	server, err := newUpstream(upstreamConfig{address: address}, newResetPacer())
	if err != nil {
		panic(err)
	}
	return server
}

func raw(text string) *connect.Request[message] {
	return connect.NewRequest(&message{binary: []byte(text)})
}

// fromJSON makes a request with a message of the protocol.
func fromJSON(t *testing.T, name, text string) *connect.Request[message] {
	t.Helper()
	request := &message{schema: find(t, name)}
	if err := (jsonCodec{}).Unmarshal([]byte(text), request); err != nil {
		t.Fatal(err)
	}
	return connect.NewRequest(request)
}

func toJSON(t *testing.T, name string, answer *message) string {
	t.Helper()
	text, err := jsonCodec{}.Marshal(&message{binary: answer.binary, schema: find(t, name)})
	if err != nil {
		t.Fatal(err)
	}
	return string(bytes.ReplaceAll(text, []byte(" "), nil))
}

func find(t *testing.T, name string) protoreflect.MessageDescriptor {
	t.Helper()
	services, err := loadServices()
	if err != nil {
		t.Fatal(err)
	}
	for _, service := range services {
		if found := service.ParentFile().Messages().ByName(protoreflect.Name(name)); found != nil {
			return found
		}
	}
	t.Fatalf("no message %s", name)
	return nil
}

func testContext(t *testing.T) context.Context {
	ctx, cancel := context.WithTimeout(context.Background(), deadline)
	t.Cleanup(cancel)
	return ctx
}

func writeFile(t *testing.T, folder, name, content string) string {
	t.Helper()
	path := filepath.Join(folder, name)
	if err := os.MkdirAll(filepath.Dir(path), 0o755); err != nil {
		t.Fatal(err)
	}
	if err := os.WriteFile(path, []byte(content), 0o644); err != nil {
		t.Fatal(err)
	}
	return path
}

// startAnswering starts a server that answers each call with an empty message. All but QueryPoint stay open.
func startAnswering(t *testing.T) string {
	t.Helper()
	server, _ := startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		if err := stream.SendMsg(&message{}); err != nil || path == queryPoint {
			return err
		}
		<-stream.Context().Done()
		return stream.Context().Err()
	})
	return server
}
