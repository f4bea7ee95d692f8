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
	address string
	tls     bool
	// PEM file with the certificates that the server's one must be signed by. Implies tls.
	caFile string
	// PEM files with the client certificate and its key, for a server that requires one. Implies tls.
	certFile string
	keyFile  string
}

// upstream is the connection to the server. It uses HTTP/2 only, so that all calls share one connection.
type upstream struct {
	client *http.Client
	url    string
}

// newUpstream returns the connection to the server. Calls with a forwarding are cancelled at the pace.
func newUpstream(cfg upstreamConfig, resets *resetPacer) (*upstream, error) {
	if _, _, err := net.SplitHostPort(cfg.address); err != nil {
		return nil, fmt.Errorf("--server: %w", err)
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
	client := &http.Client{Transport: &pacedTransport{http2, resets, defaultLimits().patience}}
	if !cfg.tls && cfg.caFile == "" && cfg.certFile == "" {
		http2.Protocols.SetUnencryptedHTTP2(true)
		return &upstream{client: client, url: "http://" + cfg.address}, nil
	}
	http2.Protocols.SetHTTP2(true)
	var err error
	if http2.TLSClientConfig, err = cfg.clientTLS(); err != nil {
		return nil, err
	}
	return &upstream{client: client, url: "https://" + cfg.address}, nil
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
