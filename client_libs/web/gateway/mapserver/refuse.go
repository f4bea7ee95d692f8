package mapserver

import (
	"errors"
	"net/http"

	"connectrpc.com/connect"
)

// statusOf has the HTTP status of answers to requests that the server refused.
var statusOf = map[connect.Code]int{
	connect.CodeInvalidArgument:    http.StatusBadRequest,
	connect.CodeUnauthenticated:    http.StatusUnauthorized,
	connect.CodePermissionDenied:   http.StatusForbidden,
	connect.CodeNotFound:           http.StatusNotFound,
	connect.CodeAborted:            http.StatusGone, // The map is another incarnation by now.
	connect.CodeOutOfRange:         http.StatusGone, // The revision is no longer kept.
	connect.CodeResourceExhausted:  http.StatusServiceUnavailable,
	connect.CodeUnavailable:        http.StatusServiceUnavailable,
	connect.CodeDeadlineExceeded:   http.StatusGatewayTimeout,
	connect.CodeFailedPrecondition: http.StatusConflict,
}

// Refuse answers a request with an error of the server.
func Refuse(w http.ResponseWriter, err error) {
	status, known := statusOf[connect.CodeOf(err)]
	if !known {
		status = http.StatusBadGateway
	}
	if status == http.StatusServiceUnavailable {
		w.Header().Set("Retry-After", "1")
	}
	http.Error(w, Message(err), status)
}

// Message returns the message of an error without its code.
func Message(err error) string {
	var failed *connect.Error
	if errors.As(err, &failed) {
		return failed.Message()
	}
	return err.Error()
}
