package main

import (
	"context"
	"fmt"
	"mime"
	"net/http"
	"runtime"
	"runtime/debug"
	"strings"
	"time"

	"connectrpc.com/connect"
	"google.golang.org/protobuf/reflect/protoreflect"
)

const (
	// peakBytes is the use of memory that counts as a peak. When it has fallen to an eighth, free memory is
	// returned to the system after calmTime; the Go runtime would take minutes.
	peakBytes = 64 << 20
	// calmTime is the time between the end of a peak and the return of its memory.
	calmTime = time.Second
)

// calls bounds the requests that are open at once, those of them that are watches, and the memory of bodies
// and answers.
type calls struct {
	limits  limits
	open    *quota
	watches *quota
	// Bytes.
	memory *quota
	resets *resetPacer
}

func newCalls(limits limits) *calls {
	return &calls{
		limits:  limits,
		open:    newQuota(limits.maxCalls, limits.addressShare),
		watches: newQuota(limits.maxWatches, limits.addressShare),
		memory:  newQuota(limits.maxTotalBodyBytes, limits.addressShare),
		resets:  newResetPacer(),
	}
}

// admit bounds the requests of all kinds, and the time of their answers. Only the answers of streams have
// no limit of time (see bound).
func (c *calls) admit(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		address := addressOf(r.RemoteAddr)
		w = &answerWriter{ResponseWriter: w, limits: &c.limits}
		if c.open.take(address, 1) {
			defer c.open.release(address, 1)
			next.ServeHTTP(w, r)
			if r.ProtoMajor == 2 {
				// Data that is still buffered may wait for a window of the client. Until then the call is open.
				_ = http.NewResponseController(w).Flush()
			}
			return
		}
		refused := fmt.Sprintf("there are too many calls: %d at once, %d of an address (--max_calls, --address_share)",
			c.open.total, c.open.share)
		if r.ProtoMajor == 2 {
			refuseInHeaders(w, r, http.StatusServiceUnavailable, connect.CodeUnavailable, refused)
			return
		}
		refuse(w, r, http.StatusServiceUnavailable, connect.CodeUnavailable, refused)
	})
}

// mostGivenUp returns how many calls of an address may wait to be cancelled at the server before others of
// the address are refused.
func (c *calls) mostGivenUp() int64 { return max(c.open.share/32, 1) }

// isWatch reports whether hypermapd counts the calls of the method as watches.
func isWatch(method protoreflect.MethodDescriptor) bool {
	switch method.FullName() {
	case "hypermap.v1.WatchService.Watch", "hypermap.v1.WatchService.Replicate",
		"hypermap.v1.RobotService.WatchRobots":
		return true
	}
	return false
}

// refuseGivenUp refuses a request if too many calls of its address wait to be cancelled. It returns whether it did.
func (c *calls) refuseGivenUp(w http.ResponseWriter, r *http.Request) bool {
	waiting := c.resets.waiting(addressOf(r.RemoteAddr))
	if waiting < c.mostGivenUp() {
		return false
	}
	refuse(w, r, http.StatusTooManyRequests, connect.CodeResourceExhausted, fmt.Sprintf(
		"%d calls of this address were given up and are not cancelled yet: the gateway cancels %d in a second (--max_calls, --address_share)",
		waiting, resetsPerSecond))
	return true
}

// takeWatch counts a watch of the request's address until release is called. If there are too many, it refuses
// the request.
func (c *calls) takeWatch(w http.ResponseWriter, r *http.Request) (release func(), ok bool) {
	address := addressOf(r.RemoteAddr)
	if !c.watches.take(address, 1) {
		refuse(w, r, http.StatusServiceUnavailable, connect.CodeUnavailable, fmt.Sprintf(
			"there are too many watches: %d at once, %d of an address (--max_watches, --address_share)",
			c.watches.total, c.watches.share))
		return nil, false
	}
	return func() { c.watches.release(address, 1) }, true
}

// bound bounds the calls of a method.
func (c *calls) bound(method protoreflect.MethodDescriptor, next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if c.refuseGivenUp(w, r) {
			return
		}
		if isWatch(method) {
			release, ok := c.takeWatch(w, r)
			if !ok {
				return
			}
			defer release()
		}
		mediaType, err := plainMediaType(r.Header.Get("Content-Type"))
		if err != nil {
			refuse(w, r, http.StatusUnsupportedMediaType, connect.CodeInvalidArgument, err.Error())
			return
		}
		r.Header.Set("Content-Type", mediaType)
		body := newRequestBody(w, r, takeBodyKind(r, method), &c.limits, c.memory)
		defer c.end(body)
		ctx, giveUp := context.WithCancel(withBody(r.Context(), body))
		forwarded := newForwarding(body)
		defer forwarded.wait()
		defer giveUp()
		r = r.WithContext(withForwarding(ctx, forwarded))
		r.Body = body
		if timed, ok := w.(*answerWriter); ok && method.IsStreamingServer() {
			w = timed.ResponseWriter // Clients of streams may be as slow as they like.
		}
		next.ServeHTTP(&refusalWriter{
			ResponseWriter: w,
			request:        r,
			body:           body,
			isUpload:       method.IsStreamingClient(),
		}, r)
	})
}

func (c *calls) end(body *requestBody) {
	body.end()
	if c.memory.fellFrom(peakBytes) {
		time.AfterFunc(calmTime, returnMemory)
	}
}

func returnMemory() {
	runtime.GC() // Buffers in pools outlive a first collection.
	debug.FreeOSMemory()
}

// plainMediaType returns the media type of a Content-Type header without parameters. The only character
// set is UTF-8.
func plainMediaType(contentType string) (string, error) {
	mediaType, parameters, err := mime.ParseMediaType(contentType)
	if err != nil {
		return "", fmt.Errorf("Content-Type %q: %w", contentType, err)
	}
	switch strings.ToLower(parameters["charset"]) {
	case "", "utf-8", "utf8":
		return mediaType, nil
	}
	return "", fmt.Errorf("Content-Type %q: the character set must be utf-8", contentType)
}

// takeBodyKind returns how to read the body of a request, and removes the header that says that it is
// packed, because requestBody unpacks it.
func takeBodyKind(r *http.Request, method protoreflect.MethodDescriptor) bodyKind {
	mediaType := r.Header.Get("Content-Type")
	kind := bodyKind{
		isJSON:     strings.HasSuffix(mediaType, "json"),
		isStream:   true,
		isUpload:   method.IsStreamingClient(),
		isDialogue: method.IsStreamingClient() && method.IsStreamingServer(),
	}
	encoding := "Grpc-Encoding"
	switch {
	case mediaType == "application/json" || mediaType == "application/proto":
		kind.isStream = false
		encoding = "Content-Encoding"
	case strings.HasPrefix(mediaType, "application/connect+"):
		encoding = "Connect-Content-Encoding"
	}
	if r.Header.Get(encoding) == "gzip" {
		kind.isPacked = true
		r.Header.Del(encoding)
	}
	return kind
}

// refusalWriter sets the HTTP status of an answer to that of the refusal of its body. Protocols whose errors
// are in the answer's body or trailers keep the status 200.
//
// It closes an HTTP/1 connection whose request was not read to its end, because the HTTP server would otherwise
// read the rest before it answers: that of a refused request, and of an upload that is answered early.
type refusalWriter struct {
	http.ResponseWriter
	request  *http.Request
	body     *requestBody
	isUpload bool
	begun    bool
}

func (w *refusalWriter) WriteHeader(status int) {
	w.begun = true
	if refused := w.body.refusal(); refused != nil {
		if status != http.StatusOK {
			status = refused.status
		}
		if refused.status == http.StatusServiceUnavailable {
			w.Header().Set("Retry-After", retryAfter)
		}
		closeUnread(w.Header(), w.request)
	}
	if (w.isUpload || status >= http.StatusBadRequest) && !w.body.isWhole.Load() {
		closeUnread(w.Header(), w.request)
	}
	w.ResponseWriter.WriteHeader(status)
}

func (w *refusalWriter) Write(data []byte) (int, error) {
	if !w.begun {
		w.WriteHeader(http.StatusOK)
	}
	return w.ResponseWriter.Write(data)
}

func (w *refusalWriter) Flush() { _ = http.NewResponseController(w.ResponseWriter).Flush() }

func (w *refusalWriter) Unwrap() http.ResponseWriter { return w.ResponseWriter }
