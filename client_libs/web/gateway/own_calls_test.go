package main

import (
	"net/http"
	"os/exec"
	"path/filepath"
	"strings"
	"testing"

	"github.com/coder/websocket"
)

// createToken adds an identity to an access file, and returns its token.
func createToken(t *testing.T, accessFile, identity string, flags ...string) string {
	t.Helper()
	arguments := append([]string{"token", "create", identity, "--file", accessFile}, flags...)
	token, err := exec.Command(program("hypermap"), arguments...).Output()
	if err != nil {
		t.Fatal(err)
	}
	return strings.TrimSpace(string(token))
}

// Foxglove's protocol and the files of VDA 5050 are for whoever may read the map.
func TestOwnPartsAskInTheNameOfTheirClient(t *testing.T) {
	access := filepath.Join(t.TempDir(), "access.yaml")
	admin := createToken(t, access, "admin", "--role=admin")
	reader := createToken(t, access, "reader", "--role=reader", "--map=office")
	stranger := createToken(t, access, "stranger", "--role=reader", "--map=elsewhere")
	gateway := startGateway(t, before(startServer(t, "--access_file="+access)))
	created, text := send(t, http.DefaultClient, http.MethodPost, gateway+"/hypermap.v1.CatalogService/CreateMap", `{"map":"office"}`,
		map[string]string{"Authorization": "Bearer " + admin, "Content-Type": "application/json"})
	if created.StatusCode != http.StatusOK {
		t.Fatal(text)
	}
	for token, statuses := range map[string][2]int{
		"":         {http.StatusUnauthorized, http.StatusUnauthorized},
		"nonsense": {http.StatusUnauthorized, http.StatusUnauthorized},
		stranger:   {http.StatusForbidden, http.StatusForbidden},
		// The map has no layer of that name.
		reader: {http.StatusSwitchingProtocols, http.StatusNotFound},
	} {
		conn, response, err := dialFoxglove(testContext(t), gateway, "/foxglove/office?access_token="+token,
			&websocket.DialOptions{Subprotocols: []string{"foxglove.sdk.v1"}})
		if response == nil || response.StatusCode != statuses[0] {
			t.Errorf("Foxglove with the token %q: %v, %v", token, response, err)
		}
		if err == nil {
			_ = conn.CloseNow()
		}
		file, _ := send(t, http.DefaultClient, http.MethodGet, gateway+"/vda5050/office/0/zoneset.json?layer=zones", "",
			map[string]string{"Authorization": "Bearer " + token})
		if file.StatusCode != statuses[1] {
			t.Errorf("a zone set with the token %q: %s", token, file.Status)
		}
	}
}

// A page of the gateway, which can't set headers of a WebSocket, is signed in by its cookie.
func TestFoxgloveIsForPagesThatAreSignedIn(t *testing.T) {
	access := filepath.Join(t.TempDir(), "access.yaml")
	admin := createToken(t, access, "admin", "--role=admin")
	cfg := before(startServer(t, "--access_file="+access))
	ours := makeCertificate(t)
	cfg.tlsCert, cfg.tlsKey = ours.certFile, ours.keyFile
	gateway := startGateway(t, cfg)
	browser := trusting(t, ours)
	post := func(path, body string, headers map[string]string) *http.Response {
		headers["Content-Type"] = "application/json"
		response, text := send(t, browser, http.MethodPost, gateway+path, body, headers)
		if response.StatusCode >= http.StatusBadRequest {
			t.Fatal(text)
		}
		return response
	}
	post("/hypermap.v1.CatalogService/CreateMap", `{"map":"office"}`, map[string]string{"Authorization": "Bearer " + admin})
	cookie := post("/session", `{"token":"`+admin+`"}`, map[string]string{}).Cookies()[0]

	// WebSocket needs a connection of HTTP/1.
	transport := browser.Transport.(*http.Transport).Clone()
	transport.ForceAttemptHTTP2, transport.TLSClientConfig.NextProtos = false, nil
	for name, c := range map[string]struct {
		cookie string
		status int
	}{
		"signed in": {cookie.Name + "=" + cookie.Value, http.StatusSwitchingProtocols},
		"not":       {"", http.StatusUnauthorized},
	} {
		conn, response, err := dialFoxglove(testContext(t), gateway, "/foxglove/office", &websocket.DialOptions{
			HTTPClient:   &http.Client{Transport: transport},
			HTTPHeader:   http.Header{"Origin": {gateway}, "Cookie": {c.cookie}},
			Subprotocols: []string{"foxglove.websocket.v1"},
		})
		if response == nil || response.StatusCode != c.status {
			t.Errorf("%s: %v, %v", name, response, err)
		}
		if err == nil {
			_ = conn.CloseNow()
		}
	}
}
