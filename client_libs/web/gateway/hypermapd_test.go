package main

import (
	"bufio"
	"net/http"
	"os"
	"os/exec"
	"path/filepath"
	"strings"
	"testing"

	"connectrpc.com/connect"
)

// program returns the path of a program of the build.
func program(name string) string {
	build := os.Getenv("HYPERMAP_BUILD")
	if build == "" {
		build = "../../../build"
	}
	return filepath.Join(build, "bin", name)
}

// startServer starts the real server on an empty folder and returns its address.
func startServer(t *testing.T, flags ...string) string {
	t.Helper()
	flags = append(flags, "--data_dir="+t.TempDir(), "--listen=127.0.0.1:0")
	command := exec.Command(program("hypermapd"), flags...)
	output, err := command.StdoutPipe()
	if err != nil {
		t.Fatal(err)
	}
	if err := command.Start(); err != nil {
		t.Fatalf("%v (make build)", err)
	}
	t.Cleanup(func() {
		_ = command.Process.Signal(os.Interrupt)
		if err := command.Wait(); err != nil {
			t.Errorf("the server ended with: %v", err)
		}
	})
	lines := bufio.NewScanner(output)
	for lines.Scan() {
		if address, ready := strings.CutPrefix(lines.Text(), "hypermapd ready on "); ready {
			return address
		}
	}
	t.Fatal("the server did not start")
	return ""
}

func TestTheRealServerAnswersThroughTheGateway(t *testing.T) {
	gateway := startGateway(t, before(startServer(t)))
	forEachProtocol(t, func(t *testing.T, as caller) {
		site := strings.ToLower(as.name)
		unary := func(path, kind, request string) (string, error) {
			method := path[strings.LastIndex(path, "/")+1:]
			answer, err := as.to(gateway, path).CallUnary(testContext(t), fromJSON(t, method+"Request", request))
			if err != nil {
				return "", err
			}
			return toJSON(t, kind, answer.Msg), nil
		}
		must := func(path, kind, request string) string {
			t.Helper()
			answer, err := unary(path, kind, request)
			if err != nil {
				t.Fatal(err)
			}
			return answer
		}
		catalog := "/hypermap.v1.CatalogService/"
		must(catalog+"CreateMap", "CreateMapResponse", `{"map":"`+site+`"}`)
		must(catalog+"CreateLayer", "CreateLayerResponse",
			`{"map":"`+site+`","layer":{"name":"things","kind":"LAYER_KIND_SEMANTIC"}}`)

		changes, err := as.to(gateway, watch).CallServerStream(testContext(t),
			fromJSON(t, "WatchRequest", `{"scope":{"map":"`+site+`"}}`))
		if err != nil {
			t.Fatal(err)
		}
		defer changes.Close()
		if !changes.Receive() {
			t.Fatal(changes.Err())
		}
		must("/hypermap.v1.EditService/ApplyEdits", "ApplyEditsResponse",
			`{"map":"`+site+`","edits":[{"putObject":{"layer":"things","object":{"label":"chair",
			"shape":{"polygon":{"outer":{"xs":[0,1,1],"ys":[0,0,1]}}}}}}]}`)
		for told := ""; !strings.Contains(told, "chair"); told = toJSON(t, "WatchResponse", changes.Msg()) {
			if !changes.Receive() {
				t.Fatal(changes.Err())
			}
		}

		found, err := as.to(gateway, "/hypermap.v1.QueryService/QueryValue").CallServerStream(testContext(t),
			fromJSON(t, "QueryValueRequest", `{"scope":{"map":"`+site+`"},"value":"chair"}`))
		if err != nil {
			t.Fatal(err)
		}
		defer found.Close()
		if !found.Receive() || !strings.Contains(toJSON(t, "QueryValueResponse", found.Msg()), `"label":"chair"`) {
			t.Errorf("no chair: %v", found.Err())
		}

		_, err = unary(queryPoint, "QueryPointResponse", `{"scope":{"map":"nowhere"},"point":{}}`)
		if connect.CodeOf(err) != connect.CodeNotFound || !strings.Contains(err.Error(), "nowhere") {
			t.Errorf("got %v", err)
		}
	})
}

func TestTheRealServerIsHealthy(t *testing.T) {
	if code := checkHealth(t, startGateway(t, before(startServer(t)))); code != http.StatusOK {
		t.Error(code)
	}
}

func TestTheRealServerIsReachedByTLS(t *testing.T) {
	server, ours := makeCertificate(t), makeCertificate(t)
	address := startServer(t, "--tls_cert="+server.certFile, "--tls_key="+server.keyFile,
		"--tls_client_ca="+ours.certFile)
	cfg := before(address)
	cfg.upstream.caFile = server.certFile
	if code := checkHealth(t, startGateway(t, cfg)); code != http.StatusServiceUnavailable {
		t.Errorf("without a certificate of ours: %d", code)
	}
	cfg.upstream.certFile, cfg.upstream.keyFile = ours.certFile, ours.keyFile
	if code := checkHealth(t, startGateway(t, cfg)); code != http.StatusOK {
		t.Errorf("with a certificate of ours: %d", code)
	}
}

func checkHealth(t *testing.T, gateway string) int {
	t.Helper()
	response, err := http.Post(gateway+"/grpc.health.v1.Health/Check", "application/json", strings.NewReader("{}"))
	if err != nil {
		t.Fatal(err)
	}
	defer response.Body.Close()
	return response.StatusCode
}
