package main

import (
	"encoding/json"
	"net/http"
	"net/url"
	"strconv"
	"strings"

	"connectrpc.com/connect"
)

// retryAfter is the number of seconds after which a client may try again what was refused for the moment.
const retryAfter = "1"

// refuse answers a request with an error of HTTP. Clients of Connect and gRPC find its message where they
// look for it.
func refuse(w http.ResponseWriter, r *http.Request, status int, code connect.Code, message string) {
	header := w.Header()
	header.Set("X-Content-Type-Options", "nosniff")
	closeUnread(header, r)
	refusalHeaders(header, r, status, code, message)
	kind := r.Header.Get("Content-Type")
	if strings.HasPrefix(kind, "application/json") || strings.HasPrefix(kind, "application/proto") {
		header.Set("Content-Type", "application/json")
		w.WriteHeader(status)
		// The client may be gone.
		_ = json.NewEncoder(w).Encode(map[string]string{"code": code.String(), "message": message})
		return
	}
	http.Error(w, message, status)
}

// refuseMethod refuses requests that are neither rpcs nor for files.
func refuseMethod(w http.ResponseWriter, r *http.Request) {
	w.Header().Set("Allow", "GET, HEAD, POST")
	refuse(w, r, http.StatusMethodNotAllowed, connect.CodeUnimplemented, "there is no such rpc")
}

// refuseInHeaders refuses a request of HTTP/2 without a body. It needs no window of the client, which could
// keep the stream open for want of one.
func refuseInHeaders(w http.ResponseWriter, r *http.Request, status int, code connect.Code, message string) {
	refusalHeaders(w.Header(), r, status, code, message)
	w.WriteHeader(status)
}

func refusalHeaders(header http.Header, r *http.Request, status int, code connect.Code, message string) {
	if status == http.StatusServiceUnavailable || status == http.StatusTooManyRequests {
		header.Set("Retry-After", retryAfter)
	}
	if strings.HasPrefix(r.Header.Get("Content-Type"), "application/grpc") {
		header.Set("Grpc-Status", strconv.Itoa(int(code)))
		header.Set("Grpc-Message", url.PathEscape(message))
	}
}

// closeUnread ends the connection of HTTP/1 after the answer. The server would otherwise read the body
// before it answers.
func closeUnread(header http.Header, r *http.Request) {
	if r.ProtoMajor == 1 && r.ContentLength != 0 {
		header.Set("Connection", "close")
	}
}
