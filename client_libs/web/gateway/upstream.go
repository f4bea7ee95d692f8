package main

import (
	"crypto/tls"
	"crypto/x509"
	"fmt"
	"net"
	"net/http"
	"os"
	"time"
)

type upstreamConfig struct {
	// HOST:PORT of the server, or of several that share their maps, with commas between.
	address string
	tls     bool
	// PEM file with the certificates that the server's one must be signed by. Implies tls.
	caFile string
	// PEM files with the client certificate and its key, for a server that requires one. Implies tls.
	certFile string
	keyFile  string
}

// upstream is the connection to the server, or to one of several. It uses HTTP/2 only, so that all calls share one
// connection.
type upstream struct {
	client *http.Client
	url    string
}

// newUpstream returns the connection to the server. Calls with a forwarding are cancelled at the pace.
func newUpstream(cfg upstreamConfig, resets *resetPacer) (*upstream, error) {
	hosts, err := parseServers(cfg.address)
	if err != nil {
		return nil, err
	}
	dialer := &net.Dialer{
		Timeout: 5 * time.Second,
		// Keep-alives detect within half a minute that the server's machine is unreachable.
		KeepAliveConfig: net.KeepAliveConfig{Enable: true, Idle: 15 * time.Second, Interval: 5 * time.Second, Count: 3},
	}
	http2 := &http.Transport{
		DialContext:         dialer.DialContext,
		TLSHandshakeTimeout: 5 * time.Second,
		Protocols:           new(http.Protocols),
		// The rpc protocols compress messages themselves.
		DisableCompression: true,
		HTTP2:              &http.HTTP2Config{MaxReceiveBufferPerStream: streamBufferBytes},
	}
	var transport http.RoundTripper = http2
	if len(hosts) > 1 {
		// A machine that does not answer pings is left; hypermapd takes one every 5 s.
		http2.HTTP2.SendPingTimeout, http2.HTTP2.PingTimeout = 10*time.Second, 10*time.Second
		transport = &servers{RoundTripper: http2, hosts: hosts}
	}
	client := &http.Client{Transport: &pacedTransport{transport, resets, defaultLimits().patience}}
	if !cfg.tls && cfg.caFile == "" && cfg.certFile == "" {
		http2.Protocols.SetUnencryptedHTTP2(true)
		return &upstream{client: client, url: "http://" + hosts[0]}, nil
	}
	http2.Protocols.SetHTTP2(true)
	if http2.TLSClientConfig, err = cfg.clientTLS(); err != nil {
		return nil, err
	}
	return &upstream{client: client, url: "https://" + hosts[0]}, nil
}

func (cfg upstreamConfig) clientTLS() (*tls.Config, error) {
	result := &tls.Config{MinVersion: tls.VersionTLS12}
	if cfg.caFile != "" {
		roots, err := readCertificates(cfg.caFile)
		if err != nil {
			return nil, fmt.Errorf("--server_ca: %w", err)
		}
		result.RootCAs = roots
	}
	if cfg.certFile != "" {
		pair, err := tls.LoadX509KeyPair(cfg.certFile, cfg.keyFile)
		if err != nil {
			return nil, fmt.Errorf("--server_cert: %w", err)
		}
		result.Certificates = []tls.Certificate{pair}
	}
	return result, nil
}

func readCertificates(path string) (*x509.CertPool, error) {
	pem, err := os.ReadFile(path)
	if err != nil {
		return nil, err
	}
	pool := x509.NewCertPool()
	if !pool.AppendCertsFromPEM(pem) {
		return nil, fmt.Errorf("no certificate in %s", path)
	}
	return pool, nil
}
