package recorder

import (
	"context"
	"os"
	"path/filepath"
	"strings"
	"testing"
)

// newTestServer returns a server that is a shell script.
func newTestServer(t *testing.T, script string) (*server, <-chan error) {
	t.Helper()
	folder := t.TempDir()
	program := filepath.Join(folder, "hypermapd")
	if err := os.WriteFile(program, []byte("#!/bin/sh\n"+script), 0o755); err != nil {
		t.Fatal(err)
	}
	died := make(chan error, 1)
	s := newServer(program, folder, filepath.Join(folder, "server.log"), func(err error) { died <- err })
	t.Cleanup(s.kill)
	return s, died
}

const ready = "echo hypermapd ready on 127.0.0.1:7\n"

func TestAServerIsKilledAndStartedAgain(t *testing.T) {
	s, died := newTestServer(t, ready+"exec sleep 1000\n")
	for range 2 {
		if err := s.start(); err != nil {
			t.Fatal(err)
		}
		if err := s.awaitUp(context.Background()); err != nil || s.currentAddress() != "127.0.0.1:7" {
			t.Fatalf("%v, %s", err, s.currentAddress())
		}
		s.kill()
		ended, cancel := context.WithCancel(context.Background())
		cancel()
		if err := s.awaitUp(ended); err == nil {
			t.Error("a killed server is up")
		}
	}
	select {
	case err := <-died:
		t.Error(err)
	default:
	}
}

func TestAServerThatEndsByItselfIsReported(t *testing.T) {
	s, died := newTestServer(t, ready+"exit 3\n")
	if err := s.start(); err != nil {
		t.Fatal(err)
	}
	if err := <-died; !strings.Contains(err.Error(), "exit status 3") {
		t.Error(err)
	}
}

func TestAServerThatDoesNotStartIsAnError(t *testing.T) {
	s, _ := newTestServer(t, "echo no >&2\nexit 1\n")
	if err := s.start(); err == nil {
		t.Error("started")
	}
}
