// hypermap-gateway connects browsers to a Hypermap server. It accepts gRPC-Web, Connect and gRPC, calls
// the server by gRPC, and serves the files of the dashboard.
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

// shutdownGrace is the time that calls have to end when the gateway stops.
const shutdownGrace = 5 * time.Second

// version is set by build.sh, from the file VERSION.
var version = "unknown"

type config struct {
	listen    string
	dashboard string
	tlsCert   string
	tlsKey    string
	// File of the key of sessions, see newSessions.
	sessionKey string
	upstream   upstreamConfig
	allowed    allowedHosts
	limits     limits
}

func main() {
	ctx, stop := signal.NotifyContext(context.Background(), syscall.SIGINT, syscall.SIGTERM)
	defer stop()
	cfg, err := parseFlags(os.Args[1:])
	if errors.Is(err, flag.ErrHelp) {
		return
	}
	if err != nil {
		os.Exit(2) // parseFlags has printed the error.
	}
	if err := run(ctx, cfg, func(url string) { fmt.Println("hypermap-gateway ready on " + url) }); err != nil {
		fmt.Fprintln(os.Stderr, "hypermap-gateway:", err)
		os.Exit(1)
	}
}

func parseFlags(args []string) (config, error) {
	cfg := config{limits: defaultLimits()}
	flags := flag.NewFlagSet("hypermap-gateway", flag.ContinueOnError)
	flags.StringVar(&cfg.upstream.address, "server", "127.0.0.1:50051", "address of the server, `HOST:PORT`, or several with commas between: the first is asked until it is unavailable, then the next")
	flags.BoolVar(&cfg.upstream.tls, "server_tls", false, "connect to the server by TLS; its certificate must be trusted by this system")
	flags.StringVar(&cfg.upstream.caFile, "server_ca", "", "connect to the server by TLS; its certificate must be signed by one in this `FILE` (PEM)")
	flags.StringVar(&cfg.upstream.certFile, "server_cert", "", "client certificate for the server, a `FILE` (PEM)")
	flags.StringVar(&cfg.upstream.keyFile, "server_key", "", "private key of --server_cert, a `FILE` (PEM)")
	flags.StringVar(&cfg.listen, "listen", "127.0.0.1:8080", "address to serve on, `HOST:PORT`; port 0 chooses a free port")
	flags.StringVar(&cfg.dashboard, "dashboard", dashboardFolder(), "folder of the dashboard's files, a `DIR`")
	flags.StringVar(&cfg.tlsCert, "tls_cert", "", "serve HTTPS with the certificate chain in this `FILE` (PEM)")
	flags.StringVar(&cfg.tlsKey, "tls_key", "", "private key of --tls_cert, a `FILE` (PEM)")
	flags.StringVar(&cfg.sessionKey, "session_key", "", "32 random bytes that seal the cookies of signed-in browsers, a `FILE`; without it, a restart signs everybody out")
	cfg.allowed.addFlag(flags)
	cfg.limits.addFlags(flags)
	showVersion := flags.Bool("version", false, "print the version and end")
	if err := flags.Parse(args); err != nil {
		return config{}, err
	}
	if *showVersion {
		fmt.Println("hypermap-gateway " + version)
		return config{}, flag.ErrHelp
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
		return errors.New("--tls_cert and --tls_key must be given together")
	}
	if (cfg.upstream.certFile == "") != (cfg.upstream.keyFile == "") {
		return errors.New("--server_cert and --server_key must be given together")
	}
	return cfg.limits.check()
}

// dashboardFolder returns the folder of the dashboard in a build folder or, if there is none, where it
// is installed.
func dashboardFolder() string {
	if built := besideExecutable("../dashboard"); isFolder(built) {
		return built
	}
	return besideExecutable("../share/hypermap/dashboard")
}

func isFolder(path string) bool {
	info, err := os.Stat(path)
	return err == nil && info.IsDir()
}

// besideExecutable returns a path relative to the folder of this program.
func besideExecutable(path string) string {
	executable, err := os.Executable()
	if err != nil {
		return filepath.Base(path)
	}
	return filepath.Join(filepath.Dir(executable), path)
}

// run serves until ctx is done. It calls ready with the URL as soon as it accepts calls.
func run(ctx context.Context, cfg config, ready func(url string)) error {
	calls := newCalls(cfg.limits)
	handler, err := newHandler(cfg, calls)
	if err != nil {
		return err
	}
	listener, err := cfg.limits.listen(cfg.listen)
	if err != nil {
		return err
	}
	guarded := calls.admit(newHosts(cfg.allowed, cfg.listen, listener.Addr()).guard(limitPath(handler)))
	// Watches never end by themselves, so this context is cancelled to end them.
	base, endCalls := context.WithCancel(context.WithoutCancel(ctx))
	defer endCalls()
	server := cfg.limits.newServer(guarded)
	server.BaseContext = func(net.Listener) context.Context { return base }
	server.RegisterOnShutdown(func() {
		calls.resets.stop()
		endCalls()
	})

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

// newHandler returns the handler of all paths.
func newHandler(cfg config, calls *calls) (http.Handler, error) {
	services, err := loadServices()
	if err != nil {
		return nil, err
	}
	upstream, err := newUpstream(cfg.upstream, calls.resets)
	if err != nil {
		return nil, err
	}
	files, err := newFiles(cfg.dashboard)
	if err != nil {
		return nil, err
	}
	signedIn, err := newSessions(cfg.sessionKey, cfg.tlsCert != "")
	if err != nil {
		return nil, err
	}
	mux := http.NewServeMux()
	signedIn.handle(mux, upstream)
	for _, service := range services {
		bridge(mux, service, upstream, calls)
	}
	calls.addOwnParts(mux, upstream)
	mux.Handle("GET /", files)
	mux.HandleFunc("/", refuseMethod)
	return signedIn.signIn(mux), nil
}
