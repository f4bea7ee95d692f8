package main

import (
	"testing"

	"connectrpc.com/connect"
	"google.golang.org/grpc"
	"google.golang.org/grpc/codes"
	"google.golang.org/grpc/status"
)

// startNamed starts a fake server that answers each call with its name, and then ends it with a status.
func startNamed(t *testing.T, name string, code codes.Code) (string, *grpc.Server) {
	t.Helper()
	return startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		if path == watch || code == codes.OK {
			if err := stream.SendMsg(&message{binary: []byte(name)}); err != nil {
				return err
			}
		}
		return status.Error(code, name)
	})
}

// ask returns the answer to a query, or the code of its error.
func ask(t *testing.T, as caller, gateway string) string {
	t.Helper()
	answer, err := as.to(gateway, queryPoint).CallUnary(testContext(t), raw(""))
	if err != nil {
		return connect.CodeOf(err).String()
	}
	return string(answer.Msg.binary)
}

func TestTheNextServerIsAskedWhenOneIsGone(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		first, stopped := startNamed(t, "first", codes.OK)
		second, _ := startNamed(t, "second", codes.OK)
		gateway := startGateway(t, before(first+", "+second))
		for range 2 {
			if answer := ask(t, as, gateway); answer != "first" {
				t.Fatal(answer)
			}
		}
		stopped.Stop()
		if answer := ask(t, as, gateway); answer != "unavailable" && answer != "second" {
			t.Error(answer)
		}
		for range 2 {
			if answer := ask(t, as, gateway); answer != "second" {
				t.Error(answer)
			}
		}
	})
}

func TestTheNextServerIsAskedWhenOneIsUnavailable(t *testing.T) {
	forEachProtocol(t, func(t *testing.T, as caller) {
		first, _ := startNamed(t, "first", codes.Unavailable)
		second, _ := startNamed(t, "second", codes.OK)
		gateway := startGateway(t, before(first+","+second))
		for i, want := range []string{"unavailable", "second", "second"} {
			if answer := ask(t, as, gateway); answer != want {
				t.Errorf("call %d: %s, want %s", i, answer, want)
			}
		}
	})
}

func TestTheNextServerIsAskedAfterAStreamEndsUnavailable(t *testing.T) {
	first, _ := startNamed(t, "first", codes.Unavailable)
	second, _ := startNamed(t, "second", codes.OK)
	gateway := startGateway(t, before(first+","+second))
	changes, err := callers[0].to(gateway, watch).CallServerStream(testContext(t), raw(""))
	if err != nil {
		t.Fatal(err)
	}
	for changes.Receive() {
	}
	if code := connect.CodeOf(changes.Err()); code != connect.CodeUnavailable {
		t.Error(changes.Err())
	}
	if answer := ask(t, callers[0], gateway); answer != "second" {
		t.Error(answer)
	}
}

func TestOtherErrorsAreTheServersAnswer(t *testing.T) {
	first, _ := startNamed(t, "first", codes.NotFound)
	second, _ := startNamed(t, "second", codes.OK)
	gateway := startGateway(t, before(first+","+second))
	for range 2 {
		if answer := ask(t, callers[0], gateway); answer != "not_found" {
			t.Error(answer)
		}
	}
}

func TestEachAddressOfAListIsChecked(t *testing.T) {
	for _, list := range []string{"", "host", "a:1,b", "a:1,,b:2"} {
		if _, err := parseServers(list); err == nil {
			t.Errorf("%q was accepted", list)
		}
	}
}
