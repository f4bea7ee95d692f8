// hypermap-gateway stands between browsers and a Hypermap server: it speaks gRPC-Web, Connect and gRPC
// to the outside, gRPC to the server, and serves the dashboard's files.
package main

import (
	"context"
	"errors"
	"flag"
	"fmt"
	"net"
	"net/http"
	"os"
	"os/signal"
	"path/filepath"
	"syscall"
	"time"
)

// How long calls may take to end when the gateway stops.
const shutdownGrace = 5 * time.Second

type config struct {
	listen    string
	dashboard string
	tlsCert   string
	tlsKey    string
	upstream  upstreamConfig
}

func main() {
	ctx, stop := signal.NotifyContext(context.Background(), syscall.SIGINT, syscall.SIGTERM)
	defer stop()
	cfg, err := parseFlags(os.Args[1:])
	if errors.Is(err, flag.ErrHelp) {
		return
	}
	if err != nil {
		os.Exit(2) // It is said already.
	}
	if err := run(ctx, cfg, func(url string) { fmt.Println("hypermap-gateway ready on " + url) }); err != nil {
		fmt.Fprintln(os.Stderr, "hypermap-gateway:", err)
		os.Exit(1)
	}
}

func parseFlags(args []string) (config, error) {
	var cfg config
	flags := flag.NewFlagSet("hypermap-gateway", flag.ContinueOnError)
	flags.StringVar(&cfg.upstream.address, "server", "127.0.0.1:50051", "the server, `HOST:PORT`")
	flags.BoolVar(&cfg.upstream.tls, "server_tls", false, "the server speaks TLS, with a certificate that this system trusts")
	flags.StringVar(&cfg.upstream.caFile, "server_ca", "", "the server speaks TLS, with a certificate signed by one in this `FILE` (PEM)")
	flags.StringVar(&cfg.upstream.certFile, "server_cert", "", "a certificate to show to the server, a `FILE` (PEM)")
	flags.StringVar(&cfg.upstream.keyFile, "server_key", "", "its private key, a `FILE` (PEM)")
	flags.StringVar(&cfg.listen, "listen", "127.0.0.1:8080", "where to serve, `HOST:PORT`; port 0 is a free one")
	flags.StringVar(&cfg.dashboard, "dashboard", besideExecutable("../dashboard"), "the dashboard's `DIR`")
	flags.StringVar(&cfg.tlsCert, "tls_cert", "", "serve HTTPS with the certificates in this `FILE` (PEM)")
	flags.StringVar(&cfg.tlsKey, "tls_key", "", "their private key, a `FILE` (PEM)")
	if err := flags.Parse(args); err != nil {
		return config{}, err
	}
	if err := cfg.check(flags.Args()); err != nil {
		fmt.Fprintln(flags.Output(), "hypermap-gateway:", err)
		return config{}, err
	}
	return cfg, nil
}

func (cfg config) check(rest []string) error {
	if len(rest) > 0 {
		return fmt.Errorf("unknown argument %q", rest[0])
	}
	if (cfg.tlsCert == "") != (cfg.tlsKey == "") {
		return errors.New("--tls_cert and --tls_key go together")
	}
	if (cfg.upstream.certFile == "") != (cfg.upstream.keyFile == "") {
		return errors.New("--server_cert and --server_key go together")
	}
	return nil
}

func besideExecutable(path string) string {
	executable, err := os.Executable()
	if err != nil {
		return filepath.Base(path)
	}
	return filepath.Join(filepath.Dir(executable), path)
}

// run serves until ctx ends; ready is told the address once calls are taken.
func run(ctx context.Context, cfg config, ready func(url string)) error {
	handler, err := newHandler(cfg)
	if err != nil {
		return err
	}
	listener, err := net.Listen("tcp", cfg.listen)
	if err != nil {
		return err
	}
	// Watches have no end of their own: they end with this context.
	calls, endCalls := context.WithCancel(context.WithoutCancel(ctx))
	defer endCalls()
	server := &http.Server{
		Handler:           handler,
		Protocols:         protocols(),
		ReadHeaderTimeout: 10 * time.Second,
		IdleTimeout:       2 * time.Minute,
		BaseContext:       func(net.Listener) context.Context { return calls },
	}
	server.RegisterOnShutdown(endCalls)

	served := make(chan error, 1)
	scheme := "http"
	if cfg.tlsCert != "" {
		scheme = "https"
		go func() { served <- server.ServeTLS(listener, cfg.tlsCert, cfg.tlsKey) }()
	} else {
		go func() { served <- server.Serve(listener) }()
	}
	ready(scheme + "://" + listener.Addr().String())

	select {
	case err := <-served:
		return err
	case <-ctx.Done():
	}
	grace, cancel := context.WithTimeout(context.WithoutCancel(ctx), shutdownGrace)
	defer cancel()
	if server.Shutdown(grace) != nil {
		return server.Close()
	}
	return nil
}

// protocols are those of browsers, and HTTP/2 without TLS, which gRPC clients speak.
func protocols() *http.Protocols {
	var p http.Protocols
	p.SetHTTP1(true)
	p.SetHTTP2(true)
	p.SetUnencryptedHTTP2(true)
	return &p
}

func newHandler(cfg config) (http.Handler, error) {
	services, err := loadServices()
	if err != nil {
		return nil, err
	}
	upstream, err := newUpstream(cfg.upstream)
	if err != nil {
		return nil, err
	}
	files, err := newFiles(cfg.dashboard)
	if err != nil {
		return nil, err
	}
	mux := http.NewServeMux()
	for _, service := range services {
		bridge(mux, service, upstream)
	}
	mux.Handle("GET /", files)
	return mux, nil
}
