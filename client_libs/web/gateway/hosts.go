package main

import (
	"errors"
	"flag"
	"fmt"
	"net"
	"net/http"
	"net/netip"
	"net/url"
	"os"
	"strings"

	"connectrpc.com/connect"
)

// hostPort is a host, and a port or "" for every port.
type hostPort struct{ host, port string }

// allowedHosts is the value of --allowed_host.
type allowedHosts struct {
	// Whether "*" was given.
	all   bool
	hosts []hostPort
}

func (a *allowedHosts) addFlag(flags *flag.FlagSet) {
	flags.Func("allowed_host",
		"`HOST` or HOST:PORT under which browsers may reach the gateway besides the address of --listen, and whose\n"+
			"pages may call it; several are separated by commas, or given by several flags.\n"+
			"\"*\" allows all, which is dangerous: every web page that is opened in a browser that can reach the gateway\n"+
			"can then read, edit and delete all maps", a.add)
}

// add parses hosts that are separated by commas.
func (a *allowedHosts) add(text string) error {
	for _, entry := range strings.Split(text, ",") {
		entry = strings.TrimSpace(entry)
		if entry == "*" {
			a.all = true
			continue
		}
		host, ok := splitHost(entry)
		if !ok {
			return fmt.Errorf("%q is not a HOST or HOST:PORT", entry)
		}
		a.hosts = append(a.hosts, host)
	}
	return nil
}

// contain reports whether the host is among those that were given by name.
func (a *allowedHosts) contain(host hostPort) bool {
	for _, allowed := range a.hosts {
		if allowed.host == host.host && (allowed.port == "" || allowed.port == host.port) {
			return true
		}
	}
	return false
}

// splitHost parses HOST or HOST:PORT, as in a Host header, and writes the host in one way: in lower case,
// without a dot at its end, and addresses without brackets.
func splitHost(text string) (hostPort, bool) {
	host, port := text, ""
	if !strings.HasSuffix(text, "]") && strings.Contains(text, ":") {
		var err error
		if host, port, err = net.SplitHostPort(text); err != nil {
			return hostPort{}, false
		}
	} else if strings.HasPrefix(text, "[") && strings.HasSuffix(text, "]") {
		host = text[1 : len(text)-1]
	}
	if address, err := netip.ParseAddr(host); err == nil {
		return hostPort{address.Unmap().WithZone("").String(), port}, true
	}
	host = strings.TrimSuffix(strings.ToLower(host), ".")
	if host == "" || strings.Trim(host, "abcdefghijklmnopqrstuvwxyz0123456789-._") != "" ||
		strings.Trim(port, "0123456789") != "" {
		return hostPort{}, false
	}
	return hostPort{host, port}, true
}

// hosts decides which requests a browser may send to the gateway.
//
// A page of any site can make its reader's browser send requests to the gateway, and by DNS rebinding the
// browser even believes that they go to the site itself. In the first case the Origin header names a
// foreign site, in the second the Host header does. Requests whose Host is not the gateway's, or whose
// Origin is neither their Host nor allowed, are refused. The port of a Host does not matter, because it
// may differ behind a tunnel; that of an Origin does.
type hosts struct {
	allowed allowedHosts
	// The address that the gateway listens on, unspecified for all addresses of the machine.
	bound netip.Addr
	// Names of that address.
	names map[string]bool
}

// newHosts returns the hosts of a gateway with the flag --listen, which is bound to the address.
func newHosts(allowed allowedHosts, listen string, bound net.Addr) *hosts {
	h := &hosts{allowed: allowed, names: map[string]bool{}}
	if address, err := netip.ParseAddrPort(bound.String()); err == nil {
		h.bound = address.Addr().Unmap().WithZone("")
	}
	if host, ok := splitHost(listen); ok {
		h.names[host.host] = true
	}
	if h.bound.IsLoopback() || h.bound.IsUnspecified() {
		h.names["localhost"] = true
	}
	if name, err := os.Hostname(); err == nil && h.bound.IsUnspecified() {
		h.names[strings.ToLower(name)] = true
	}
	return h
}

// guard refuses requests with a wrong Host or Origin, and answers those of allowed origins so that
// browsers let their pages read the answers (CORS).
func (h *hosts) guard(next http.Handler) http.Handler {
	return http.HandlerFunc(func(w http.ResponseWriter, r *http.Request) {
		if !h.isOwn(r.Host) {
			refuse(w, r, http.StatusMisdirectedRequest, connect.CodePermissionDenied, fmt.Sprintf(
				"%q is not a host of this gateway; if it should be, start the gateway with --allowed_host=HOST", r.Host))
			return
		}
		for _, origin := range r.Header["Origin"] {
			if isSameOrigin(origin, r) {
				continue
			}
			if !h.isAllowedOrigin(origin) {
				refuse(w, r, http.StatusForbidden, connect.CodePermissionDenied, fmt.Sprintf(
					"pages of %q may not use this gateway; to let them, start it with --allowed_host=HOST:PORT", origin))
				return
			}
			w.Header().Set("Access-Control-Allow-Origin", origin)
			w.Header().Add("Vary", "Origin")
			if isPreflight(r) {
				answerPreflight(w)
				return
			}
			w.Header().Set("Access-Control-Expose-Headers", "*")
		}
		next.ServeHTTP(w, r)
	})
}

func (h *hosts) isOwn(host string) bool {
	if h.allowed.all {
		return true
	}
	asked, ok := splitHost(host)
	if !ok {
		return false
	}
	if h.names[asked.host] {
		return true
	}
	// No site but the machine's own is behind an address, whereas a name can be made to point anywhere.
	if address, err := netip.ParseAddr(asked.host); err == nil {
		switch {
		case h.bound.IsUnspecified():
			return true
		case h.bound.IsLoopback() && address.IsLoopback(), address == h.bound:
			return true
		}
	}
	if asked.port != "" {
		return h.allowed.contain(asked)
	}
	// A proxy may have ended TLS, so the missing port is that of HTTP or of HTTPS.
	return h.allowed.contain(hostPort{asked.host, "80"}) || h.allowed.contain(hostPort{asked.host, "443"})
}

func (h *hosts) isAllowedOrigin(origin string) bool {
	if h.allowed.all {
		return true
	}
	_, page, err := splitOrigin(origin)
	return err == nil && h.allowed.contain(page)
}

// isSameOrigin reports whether the page was loaded from the host of the request. The schemes may differ
// without TLS, because a proxy may have ended it.
func isSameOrigin(origin string, r *http.Request) bool {
	scheme, page, err := splitOrigin(origin)
	if err != nil || (r.TLS != nil && scheme != "https") {
		return false
	}
	asked, ok := splitHost(r.Host)
	if asked.port == "" {
		asked.port = defaultPorts[scheme]
	}
	return ok && page == asked
}

var defaultPorts = map[string]string{"http": "80", "https": "443"}

// splitOrigin parses an Origin header. The port is never empty.
func splitOrigin(origin string) (scheme string, host hostPort, err error) {
	parsed, err := url.Parse(origin)
	if err != nil {
		return "", hostPort{}, err
	}
	host, ok := splitHost(parsed.Host)
	if !ok || defaultPorts[parsed.Scheme] == "" {
		return "", hostPort{}, errors.New("not the origin of a web page")
	}
	if host.port == "" {
		host.port = defaultPorts[parsed.Scheme]
	}
	return parsed.Scheme, host, nil
}

func isPreflight(r *http.Request) bool {
	return r.Method == http.MethodOptions && r.Header.Get("Access-Control-Request-Method") != ""
}

// answerPreflight allows the methods and headers of gRPC-Web and Connect. Credentials that a browser adds
// by itself, such as cookies, are not allowed, because a page has to send its token itself.
func answerPreflight(w http.ResponseWriter) {
	header := w.Header()
	header.Set("Access-Control-Allow-Methods", "GET, POST")
	header.Set("Access-Control-Allow-Headers", "Authorization, X-Request-Id, Traceparent, Tracestate, "+
		"Content-Type, Content-Encoding, X-Grpc-Web, X-User-Agent, Grpc-Timeout, Connect-Protocol-Version, Connect-Timeout-Ms, Connect-Content-Encoding, Connect-Accept-Encoding")
	header.Set("Access-Control-Max-Age", "7200")
	w.WriteHeader(http.StatusNoContent)
}
