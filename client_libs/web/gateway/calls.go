package main

import (
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
	// peakBytes is the memory of bodies after which free memory is returned to the system at once. The Go
	// runtime takes minutes otherwise.
	peakBytes = 64 << 20
	// calmTime is the time between the end of a peak and the return of its memory.
	calmTime = time.Second
)

// calls bounds the calls that are open at once, and the memory of their bodies.
type calls struct {
	limits limits
	open   *quota
	// Bytes.
	memory *quota
}

func newCalls(limits limits) *calls {
	return &calls{
		limits: limits,
		open:   newQuota(limits.maxCalls, limits.addressShare),
		memory: newQuota(limits.maxTotalBodyBytes, limits.addressShare),
	}
}

// bound bounds the calls of a method.
func (c *calls) bound(method protoreflect.MethodDescriptor, next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		address := addressOf(r.RemoteAddr)
		if !c.open.take(address, 1) {
			refuse(w, r, http.StatusServiceUnavailable, connect.CodeUnavailable, fmt.Sprintf(
				"there are too many calls: %d at once, %d of an address (--max_calls, --address_share)",
				c.open.total, c.open.share))
			return
		}
		defer c.open.release(address, 1)
		mediaType, err := plainMediaType(r.Header.Get("Content-Type"))
		if err != nil {
			refuse(w, r, http.StatusUnsupportedMediaType, connect.CodeInvalidArgument, err.Error())
			return
		}
		r.Header.Set("Content-Type", mediaType)
		body := newRequestBody(w, r, takeBodyKind(r, method), &c.limits, c.memory)
		defer c.end(body)
		r = r.WithContext(withBody(r.Context(), body))
		r.Body = body
		if !method.IsStreamingServer() {
			w = &answerWriter{ResponseWriter: w, limits: &c.limits}
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

// refusalWriter gives the answer to a refused body the status of the refusal. Protocols whose errors are
// in the answer's body or trailers keep their status 200.
//
// An upload may be answered before its end, too. Then the rest of it is not waited for.
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
	if w.isUpload && !w.body.isWhole.Load() {
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
