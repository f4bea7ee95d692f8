package main

import (
	"crypto/ecdsa"
	"crypto/elliptic"
	"crypto/rand"
	"crypto/tls"
	"crypto/x509"
	"crypto/x509/pkix"
	"encoding/pem"
	"math/big"
	"net"
	"net/http"
	"strings"
	"testing"
	"time"

	"connectrpc.com/connect"
)

type keyPair struct {
	certFile string
	keyFile  string
}

// makeCertificate makes a self-signed certificate for the loopback address.
func makeCertificate(t *testing.T) keyPair {
	t.Helper()
	key, err := ecdsa.GenerateKey(elliptic.P256(), rand.Reader)
	if err != nil {
		t.Fatal(err)
	}
	template := &x509.Certificate{
		SerialNumber:          big.NewInt(1),
		Subject:               pkix.Name{CommonName: "hypermap test"},
		NotBefore:             time.Now().Add(-time.Hour),
		NotAfter:              time.Now().Add(time.Hour),
		IPAddresses:           []net.IP{net.IPv4(127, 0, 0, 1)},
		DNSNames:              []string{"localhost"},
		IsCA:                  true,
		BasicConstraintsValid: true,
	}
	cert, err := x509.CreateCertificate(rand.Reader, template, template, key.Public(), key)
	if err != nil {
		t.Fatal(err)
	}
	private, err := x509.MarshalPKCS8PrivateKey(key)
	if err != nil {
		t.Fatal(err)
	}
	folder := t.TempDir()
	block := func(kind string, bytes []byte) string {
		return string(pem.EncodeToMemory(&pem.Block{Type: kind, Bytes: bytes}))
	}
	return keyPair{
		certFile: writeFile(t, folder, "cert.pem", block("CERTIFICATE", cert)),
		keyFile:  writeFile(t, folder, "key.pem", block("PRIVATE KEY", private)),
	}
}

func trusting(t *testing.T, pair keyPair) *http.Client {
	t.Helper()
	roots, err := readCertificates(pair.certFile)
	if err != nil {
		t.Fatal(err)
	}
	transport := http.DefaultTransport.(*http.Transport).Clone()
	transport.TLSClientConfig = &tls.Config{RootCAs: roots}
	transport.ForceAttemptHTTP2 = true
	t.Cleanup(transport.CloseIdleConnections)
	return &http.Client{Transport: transport}
}

func TestTLSOnBothSides(t *testing.T) {
	inside, outside := makeCertificate(t), makeCertificate(t)
	server, _ := startBackend(t, "127.0.0.1:0", echo, withTLS(inside))
	cfg := before(server)
	cfg.upstream.caFile = inside.certFile
	cfg.tlsCert, cfg.tlsKey = outside.certFile, outside.keyFile
	gateway := startGateway(t, cfg)
	if !strings.HasPrefix(gateway, "https://") {
		t.Errorf("ready on %s", gateway)
	}
	browser := trusting(t, outside)
	forEachProtocol(t, func(t *testing.T, as caller) {
		options := append([]connect.ClientOption{connect.WithCodec(binaryCodec{})}, as.options...)
		client := connect.NewClient[message, message](browser, gateway+queryPoint, options...)
		answer, err := client.CallUnary(testContext(t), raw("hello"))
		if err != nil || string(answer.Msg.binary) != queryPoint+" hello" {
			t.Errorf("%v, error %v", answer, err)
		}
	})
}

func TestAServerThatIsNotTrustedIsUnavailable(t *testing.T) {
	server, _ := startBackend(t, "127.0.0.1:0", echo, withTLS(makeCertificate(t)))
	for name, cfg := range map[string]upstreamConfig{
		"signed by somebody else":    {address: server, caFile: makeCertificate(t).certFile},
		"not trusted by this system": {address: server, tls: true},
		"asked without TLS":          {address: server},
	} {
		t.Run(name, func(t *testing.T) {
			gateway := startGateway(t, config{upstream: cfg})
			_, err := callers[0].to(gateway, queryPoint).CallUnary(testContext(t), raw(""))
			if connect.CodeOf(err) != connect.CodeUnavailable {
				t.Errorf("got %v", err)
			}
		})
	}
}
