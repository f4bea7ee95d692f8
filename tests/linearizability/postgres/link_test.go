package postgres

import (
	"errors"
	"io"
	"net"
	"os"
	"testing"
	"time"
)

// silence is for how long nothing must arrive.
const silence = 50 * time.Millisecond

// pair is a connection through a link, by its two ends.
type pair struct {
	link           *Link
	client, server net.Conn
}

func newPair(t *testing.T) *pair {
	t.Helper()
	listener, err := net.Listen("tcp", "127.0.0.1:0")
	if err != nil {
		t.Fatal(err)
	}
	defer listener.Close()
	p := &pair{}
	if p.link, err = NewLink(listener.Addr().String()); err != nil {
		t.Fatal(err)
	}
	t.Cleanup(p.link.Close)
	if p.client, err = net.Dial("tcp", p.link.Address()); err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { _ = p.client.Close() })
	if p.server, err = listener.Accept(); err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { _ = p.server.Close() })
	return p
}

func send(t *testing.T, to net.Conn, text string) {
	t.Helper()
	if _, err := to.Write([]byte(text)); err != nil {
		t.Fatal(err)
	}
}

func expect(t *testing.T, from net.Conn, text string) {
	t.Helper()
	_ = from.SetReadDeadline(time.Now().Add(time.Minute))
	got := make([]byte, len(text))
	if _, err := io.ReadFull(from, got); err != nil || string(got) != text {
		t.Fatalf("got %q, %v, want %q", got, err, text)
	}
}

func expectSilence(t *testing.T, from net.Conn) {
	t.Helper()
	_ = from.SetReadDeadline(time.Now().Add(silence))
	buffer := make([]byte, 1)
	if count, err := from.Read(buffer); count > 0 || err == io.EOF {
		t.Fatalf("got %q, %v while the link is cut", buffer[:count], err)
	}
}

func expectEnd(t *testing.T, from net.Conn) {
	t.Helper()
	_ = from.SetReadDeadline(time.Now().Add(time.Minute))
	if _, err := from.Read(make([]byte, 1)); err == nil || errors.Is(err, os.ErrDeadlineExceeded) {
		t.Fatalf("the connection goes on: %v", err)
	}
}

func TestALinkPassesBytesOnInBothDirections(t *testing.T) {
	p := newPair(t)
	send(t, p.client, "select")
	expect(t, p.server, "select")
	send(t, p.server, "row")
	expect(t, p.client, "row")
}

func TestACutDirectionIsSilentAndItsBytesArriveLate(t *testing.T) {
	p := newPair(t)
	p.link.Cut(Answers)
	send(t, p.client, "commit")
	expect(t, p.server, "commit")
	send(t, p.server, "done")
	expectSilence(t, p.client)
	p.link.Mend(true)
	expect(t, p.client, "done")
}

func TestTheEndOfAConnectionIsNotToldDuringACut(t *testing.T) {
	p := newPair(t)
	p.link.Cut(Requests)
	send(t, p.client, "commit")
	_ = p.client.Close()
	expectSilence(t, p.server)
	p.link.Mend(true)
	expect(t, p.server, "commit")
	expectEnd(t, p.server)
}

func TestConnectionsMayBeLostInACut(t *testing.T) {
	p := newPair(t)
	p.link.Cut(Requests)
	send(t, p.client, "commit")
	expectSilence(t, p.server)
	p.link.Mend(false)
	expectEnd(t, p.server)
	expectEnd(t, p.client)
}

func TestAConnectionThatBeginsDuringACutIsMadeAfterIt(t *testing.T) {
	p := newPair(t)
	p.link.Cut(Requests)
	late, err := net.Dial("tcp", p.link.Address())
	if err != nil {
		t.Fatal(err)
	}
	defer late.Close()
	expectSilence(t, late)
	p.link.Mend(false)
	expectEnd(t, late)
}
