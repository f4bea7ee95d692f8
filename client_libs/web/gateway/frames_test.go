package main

import (
	"bytes"
	"net"
	"strconv"
	"testing"

	"golang.org/x/net/http2"
	"golang.org/x/net/http2/hpack"
)

// frames is a connection of HTTP/2 whose frames a test chooses.
type frames struct {
	*http2.Framer
	conn   net.Conn
	stream uint32
}

// openFrames connects from the local address and gives the gateway a window of this many bytes for each answer.
func openFrames(t *testing.T, gateway, local string, window uint32) *frames {
	t.Helper()
	conn := dial(t, gateway, local)
	if _, err := conn.Write([]byte(http2.ClientPreface)); err != nil {
		t.Fatal(err)
	}
	f := &frames{Framer: http2.NewFramer(conn, conn), conn: conn, stream: 1}
	f.ReadMetaHeaders = hpack.NewDecoder(4096, nil)
	if err := f.WriteSettings(http2.Setting{ID: http2.SettingInitialWindowSize, Val: window}); err != nil {
		t.Fatal(err)
	}
	return f
}

// request sends a request without a body, with pairs of names and values of headers, and returns its stream.
func (f *frames) request(t *testing.T, method, path string, headers ...string) uint32 {
	t.Helper()
	var block bytes.Buffer
	encoder := hpack.NewEncoder(&block)
	pairs := append([]string{":method", method, ":scheme", "http", ":path", path}, headers...)
	for i := 0; i < len(pairs); i += 2 {
		_ = encoder.WriteField(hpack.HeaderField{Name: pairs[i], Value: pairs[i+1]}) // A buffer takes all.
	}
	stream := f.stream
	f.stream += 2
	err := f.WriteHeaders(http2.HeadersFrameParam{
		StreamID: stream, BlockFragment: block.Bytes(), EndStream: true, EndHeaders: true,
	})
	if err != nil {
		t.Fatal(err)
	}
	return stream
}

// next returns the next frame of a stream, and answers pings and settings meanwhile.
func (f *frames) next(t *testing.T) http2.Frame {
	t.Helper()
	for {
		frame, err := f.ReadFrame()
		if err != nil {
			t.Fatal(err)
		}
		switch frame := frame.(type) {
		case *http2.PingFrame:
			if !frame.IsAck() {
				_ = f.WritePing(true, frame.Data) // An error is one of the next read, too.
			}
		case *http2.SettingsFrame:
			if !frame.IsAck() {
				_ = f.WriteSettingsAck()
			}
		}
		if frame.Header().StreamID != 0 {
			return frame
		}
	}
}

// statuses reads the headers of this many answers and counts their statuses.
func (f *frames) statuses(t *testing.T, answers int) map[int]int {
	t.Helper()
	counts := map[int]int{}
	for range answers {
		for {
			if frame, ok := f.next(t).(*http2.MetaHeadersFrame); ok {
				status, _ := strconv.Atoi(frame.PseudoValue("status"))
				counts[status]++
				break
			}
		}
	}
	return counts
}

// untilReset reads frames until this many streams were reset.
func (f *frames) untilReset(t *testing.T, streams int) {
	t.Helper()
	for streams > 0 {
		if _, ok := f.next(t).(*http2.RSTStreamFrame); ok {
			streams--
		}
	}
}
