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
