package main

import (
	"context"
	"net/http"
	"net/netip"

	"hypermap-gateway/foxglove"
	"hypermap-gateway/mapserver"
	"hypermap-gateway/vda5050"
)

// ownCalls makes the calls of the gateway's own parts, such as Foxglove's protocol, for a client. They count for
// the memory of the client's address, and are cancelled in its turn, like the calls that the gateway forwards.
type ownCalls struct {
	calls   *calls
	address netip.Addr
}

// addOwnParts adds the handlers of the parts of the gateway that understand what the server answers.
func (c *calls) addOwnParts(mux *http.ServeMux, upstream *upstream) {
	server := mapserver.New(upstream.client, upstream.url)
	viewers := foxglove.Limits{PingAfter: c.limits.pingAfter, Patience: c.limits.patience, TimeFor: c.limits.timeFor}
	for path, handler := range map[string]http.Handler{
		"/foxglove/{map}":                        c.watching(c.serveOwn(server, viewers.Serve)),
		"/vda5050/{map}":                         c.serveOwn(server, vda5050.ServeNewest),
		"/vda5050/{map}/{file}":                  c.serveOwn(server, vda5050.ServeRelease),
		"/vda5050/{map}/{revision}/zoneset.json": c.serveOwn(server, vda5050.ServeZoneSet),
	} {
		mux.Handle("GET "+path, withQueryToken(handler))
	}
}

// serveOwn returns a handler that asks the server in the name of its client.
func (c *calls) serveOwn(server *mapserver.Server, serve func(http.ResponseWriter, *http.Request, *mapserver.Caller)) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if c.refuseGivenUp(w, r) {
			return
		}
		header := http.Header{}
		passHeaders(r.Header, header)
		serve(w, r, &mapserver.Caller{
			Server:    server,
			Admission: &ownCalls{c, addressOf(r.RemoteAddr)},
			Header:    header,
		})
	})
}

// watching counts the requests of a handler as watches, and lets their clients be as slow as they like.
func (c *calls) watching(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		release, ok := c.takeWatch(w, r)
		if !ok {
			return
		}
		defer release()
		if timed, ok := w.(*answerWriter); ok {
			w = timed.ResponseWriter
		}
		next.ServeHTTP(w, r)
	})
}

// withQueryToken takes the token of a call from the parameter access_token of its URL (RFC 6750, 2.3), for
// programs that can't set headers.
func withQueryToken(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if token := r.URL.Query().Get("access_token"); token != "" {
			r.Header.Set("Authorization", "Bearer "+token)
		}
		next.ServeHTTP(w, r)
	})
}

// Begin implements mapserver.Admission.
func (o *ownCalls) Begin(ctx context.Context) mapserver.Call {
	body := &requestBody{limits: &o.calls.limits, memory: o.calls.memory, address: o.address, Reader: http.NoBody}
	body.isWhole.Store(true)
	forwarded := newForwarding(body)
	ctx, giveUp := context.WithCancel(withForwarding(withBody(ctx, body), forwarded))
	return &ownCall{o.calls, ctx, giveUp, body, forwarded}
}

// ownCall implements mapserver.Call.
type ownCall struct {
	calls     *calls
	ctx       context.Context
	giveUp    context.CancelFunc
	body      *requestBody
	forwarded *forwarding
}

func (c *ownCall) Context() context.Context { return c.ctx }

func (c *ownCall) Explain(err error) error { return failure(c.ctx, err) }

func (c *ownCall) Take(bytes int64) error { return c.body.takeForAnswer(bytes) }

func (c *ownCall) Release() { c.body.releaseAnswer() }

func (c *ownCall) End() {
	c.giveUp()
	c.forwarded.wait()
	c.calls.end(c.body)
}
