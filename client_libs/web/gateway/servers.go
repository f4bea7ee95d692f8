package main

import (
	"errors"
	"fmt"
	"io"
	"net"
	"net/http"
	"strconv"
	"strings"
	"sync/atomic"

	"google.golang.org/grpc/codes"
)

// servers sends requests to one of several servers that share their maps, at the beginning to the first, until it
// fails; then to the next, in a circle. It sends no request twice: clients know which calls may be repeated. Safe
// for concurrent use.
type servers struct {
	http.RoundTripper
	hosts   []string
	current atomic.Uint32
}

// parseServers returns the addresses in a list with commas between them.
func parseServers(list string) ([]string, error) {
	hosts := strings.Split(list, ",")
	for i := range hosts {
		hosts[i] = strings.TrimSpace(hosts[i])
		if _, _, err := net.SplitHostPort(hosts[i]); err != nil {
			return nil, fmt.Errorf("--server: %w", err)
		}
	}
	return hosts, nil
}

func (s *servers) RoundTrip(r *http.Request) (*http.Response, error) {
	chosen := s.current.Load()
	out := r.WithContext(r.Context()) // A copy, since a RoundTripper must not change its request.
	url := *r.URL
	url.Host = s.hosts[chosen]
	out.URL, out.Host = &url, ""
	answer, err := s.RoundTripper.RoundTrip(out)
	if err != nil {
		if r.Context().Err() == nil {
			s.leave(chosen)
		}
		return nil, err
	}
	if isUnavailable(answer.Header) {
		s.leave(chosen)
	}
	answer.Body = &toldBody{answer.Body, func(err error) {
		if isUnavailable(answer.Trailer) || (!errors.Is(err, io.EOF) && r.Context().Err() == nil) {
			s.leave(chosen)
		}
	}}
	return answer, nil
}

// leave makes the next server the current one. Of calls that fail together, the first moves on.
func (s *servers) leave(failed uint32) {
	s.current.CompareAndSwap(failed, (failed+1)%uint32(len(s.hosts)))
}

// isUnavailable returns whether a call has ended with UNAVAILABLE. Its status is in the trailer, or in the header if
// there is no message.
func isUnavailable(fields http.Header) bool {
	return fields.Get("Grpc-Status") == strconv.Itoa(int(codes.Unavailable))
}

// toldBody tells how it ends: io.EOF, or the error that cut it off.
type toldBody struct {
	io.ReadCloser
	ended func(err error)
}

func (b *toldBody) Read(p []byte) (int, error) {
	n, err := b.ReadCloser.Read(p)
	if err != nil {
		b.ended(err)
	}
	return n, err
}
