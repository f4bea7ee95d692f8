// Package mapserver calls hypermapd for the parts of the gateway that understand its answers.
package mapserver

import (
	"context"
	"net/http"

	"connectrpc.com/connect"

	pb "hypermap-gateway/gen/hypermapv1"
)

// maxAnswerBytes is the largest message of an answer. It is above the server's own limit.
const maxAnswerBytes = 64 << 20

// Server has the rpcs of hypermapd that the gateway itself calls. Safe for concurrent use.
type Server struct {
	getMap         *connect.Client[pb.GetMapRequest, pb.GetMapResponse]
	listLayers     *connect.Client[pb.ListLayersRequest, pb.ListLayersResponse]
	listTransforms *connect.Client[pb.ListTransformsRequest, pb.ListTransformsResponse]
	queryPoint     *connect.Client[pb.QueryPointRequest, pb.QueryPointResponse]
	queryArea      *connect.Client[pb.QueryAreaRequest, pb.QueryAreaResponse]
	listChanges    *connect.Client[pb.ListChangesRequest, pb.ListChangesResponse]
	watch          *connect.Client[pb.WatchRequest, pb.WatchResponse]
}

// New returns the rpcs of the server at a URL. Sends nothing.
func New(http connect.HTTPClient, url string) *Server {
	const catalog, query, changes = "CatalogService", "QueryService", "WatchService"
	return &Server{
		getMap:         rpc[pb.GetMapRequest, pb.GetMapResponse](http, url, catalog, "GetMap"),
		listLayers:     rpc[pb.ListLayersRequest, pb.ListLayersResponse](http, url, catalog, "ListLayers"),
		listTransforms: rpc[pb.ListTransformsRequest, pb.ListTransformsResponse](http, url, catalog, "ListTransforms"),
		queryPoint:     rpc[pb.QueryPointRequest, pb.QueryPointResponse](http, url, query, "QueryPoint"),
		queryArea:      rpc[pb.QueryAreaRequest, pb.QueryAreaResponse](http, url, query, "QueryArea"),
		listChanges:    rpc[pb.ListChangesRequest, pb.ListChangesResponse](http, url, changes, "ListChanges"),
		watch:          rpc[pb.WatchRequest, pb.WatchResponse](http, url, changes, "Watch"),
	}
}

func rpc[Request, Answer any](http connect.HTTPClient, url, service, method string) *connect.Client[Request, Answer] {
	return connect.NewClient[Request, Answer](http, url+"/hypermap.v1."+service+"/"+method,
		connect.WithGRPC(),
		connect.WithAcceptCompression("gzip", nil, nil),
		connect.WithReadMaxBytes(maxAnswerBytes))
}

// Admission lets the gateway make calls for one of its clients.
type Admission interface {
	// Begin begins a call to the server, which ends with ctx.
	Begin(ctx context.Context) Call
}

// Call is a call to the server that is made for a client. Its answers take memory of the client.
type Call interface {
	Context() context.Context
	// Explain returns an error of the call as one for the client. Returns nil for nil.
	Explain(err error) error
	// Take takes memory of the client for what is made of the answers.
	Take(bytes int64) error
	// Release gives back the memory that was taken so far.
	Release()
	// End gives back all memory, and returns when the server's part of the call has ended.
	End()
}

// Caller calls the server in the name of a client of the gateway. All its errors are of
// *connect.Error, with the server's code and message. Safe for concurrent use.
type Caller struct {
	Server    *Server
	Admission Admission
	// Header tells the server who calls.
	Header http.Header
}

// request returns a request with the caller's headers.
func request[Request any](c *Caller, message *Request) *connect.Request[Request] {
	made := connect.NewRequest(message)
	for name, values := range c.Header {
		made.Header()[name] = values
	}
	return made
}

// ask makes a call with one answer, whose memory it does not keep.
func ask[Request, Answer any](ctx context.Context, c *Caller, method *connect.Client[Request, Answer], message *Request) (*Answer, error) {
	call := c.Admission.Begin(ctx)
	defer call.End()
	answer, err := method.CallUnary(call.Context(), request(c, message))
	if err != nil {
		return nil, call.Explain(err)
	}
	return answer.Msg, nil
}

// stream makes a call with many answers, until `take` returns an error. The answers keep their memory.
func stream[Request, Answer any](c *Caller, call Call, method *connect.Client[Request, Answer], message *Request, take func(*Answer) error) error {
	answers, err := method.CallServerStream(call.Context(), request(c, message))
	if err != nil {
		return call.Explain(err)
	}
	defer answers.Close()
	for answers.Receive() {
		if err := take(answers.Msg()); err != nil {
			return err
		}
	}
	return call.Explain(answers.Err())
}
