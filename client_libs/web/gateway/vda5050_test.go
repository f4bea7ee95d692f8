package main

import (
	"archive/zip"
	"bytes"
	"crypto/sha256"
	"encoding/base64"
	"encoding/json"
	"fmt"
	"io"
	"net/http"
	"slices"
	"strings"
	"testing"

	"google.golang.org/grpc"
	"google.golang.org/grpc/metadata"

	pb "hypermap-gateway/gen/hypermapv1"
)

// get returns the answer to a GET request and its body.
func (s site) get(path string) (*http.Response, []byte) {
	s.t.Helper()
	response, text := send(s.t, http.DefaultClient, http.MethodGet, s.gateway+path, "", nil)
	return response, []byte(text)
}

// newestRelease returns the answer about the newest revision of the map "office".
func (s site) newestRelease() map[string]string {
	s.t.Helper()
	response, text := s.get("/vda5050/office")
	newest := map[string]string{}
	if err := json.Unmarshal(text, &newest); err != nil || response.StatusCode != http.StatusOK {
		s.t.Fatalf("%s: %s", response.Status, text)
	}
	return newest
}

// unzip returns the files of an archive by their names.
func unzip(t *testing.T, data []byte) map[string]string {
	t.Helper()
	archive, err := zip.NewReader(bytes.NewReader(data), int64(len(data)))
	if err != nil {
		t.Fatal(err)
	}
	files := map[string]string{}
	for _, file := range archive.File {
		content, err := file.Open()
		if err != nil {
			t.Fatal(err)
		}
		text, err := io.ReadAll(content)
		if err != nil {
			t.Fatal(err)
		}
		files[file.Name] = string(text)
	}
	return files
}

// exportNav2 returns the files of the server's own export for nav2.
func exportNav2(t *testing.T, gateway string) map[string]string {
	t.Helper()
	exported, err := callers[2].to(gateway, "/hypermap.v1.CatalogService/ExportMap").CallServerStream(testContext(t),
		fromJSON(t, "ExportMapRequest", `{"map":"office","format":"FILE_FORMAT_NAV2"}`))
	if err != nil {
		t.Fatal(err)
	}
	defer exported.Close()
	files := map[string]string{}
	for exported.Receive() {
		var part pb.ExportMapResponse
		if err := (binaryCodec{}).Unmarshal(exported.Msg().binary, &part); err != nil {
			t.Fatal(err)
		}
		if chunk := part.GetChunk(); chunk != nil {
			files[chunk.GetFileName()] += string(chunk.GetData())
		}
	}
	if exported.Err() != nil {
		t.Fatal(exported.Err())
	}
	return files
}

func TestVDA5050OffersTheNewestRevision(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	newest := s.newestRelease()
	if newest["mapId"] != "office" || newest["mapVersion"] != "3" {
		t.Errorf("newest %v", newest)
	}
	link, ours := strings.CutPrefix(newest["mapDownloadLink"], s.gateway)
	if !ours {
		t.Fatalf("link %s", newest["mapDownloadLink"])
	}
	response, file := s.get(link)
	header := response.Header
	digest := sha256.Sum256(file)
	for name, want := range map[string]string{
		"Content-Length": fmt.Sprint(len(file)),
		"Content-Type":   "application/zip",
		"Cache-Control":  "public, max-age=31536000, immutable",
		"Etag":           fmt.Sprintf(`"%x"`, digest),
		"Repr-Digest":    "sha-256=:" + base64.StdEncoding.EncodeToString(digest[:]) + ":",
	} {
		if header.Get(name) != want {
			t.Errorf("%s: %q instead of %q", name, header.Get(name), want)
		}
	}
	if newest["sha256"] != fmt.Sprintf("%x", digest) {
		t.Errorf("the link has the hash %s, the file %x", newest["sha256"], digest)
	}
	if _, line := s.get("/vda5050/office/3.zip.sha256"); string(line) != fmt.Sprintf("%x  3.zip\n", digest) {
		t.Errorf("line %q", line)
	}
	again, _ := send(t, http.DefaultClient, http.MethodGet, s.gateway+link, "", map[string]string{"If-None-Match": header.Get("Etag")})
	if again.StatusCode != http.StatusNotModified {
		t.Errorf("the same file again: %s", again.Status)
	}
}

func TestVDA5050FilesAreThoseOfTheServersOwnExport(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	_, file := s.get("/vda5050/office/3.zip")
	files := unzip(t, file)
	exported := exportNav2(t, s.gateway)
	for _, name := range []string{"floor.yaml", "floor.pgm"} {
		if files[name] == "" || files[name] != exported[name] {
			t.Errorf("%s:\n%q instead of\n%q", name, files[name], exported[name])
		}
	}
	if !strings.Contains(files["map.json"], `"mapVersion": "3"`) || len(files) != 3 {
		t.Errorf("files %v", files)
	}
}

func TestVDA5050FilesOfARevisionStayAsTheyAre(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	_, before := s.get("/vda5050/office/3.zip")
	s.edit(`{"writeCells":{"layer":"floor","box":{"rowBegin":2,"rowEnd":3,"colBegin":1,"colEnd":2},"values":[1]}}`)
	if _, after := s.get("/vda5050/office/3.zip"); !bytes.Equal(before, after) {
		t.Error("the file of an old revision has changed")
	}
	if _, newest := s.get("/vda5050/office/4.zip"); unzip(t, newest)["floor.pgm"] == unzip(t, before)["floor.pgm"] {
		t.Error("the file of the new revision has the old cells")
	}
}

func TestVDA5050TellsWhatIsNotThere(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	old := strings.TrimPrefix(s.newestRelease()["mapDownloadLink"], s.gateway)
	expect := func(path string, status int, word string) {
		t.Helper()
		response, text := s.get(path)
		if response.StatusCode != status || !strings.Contains(string(text), word) {
			t.Errorf("%s: %s %s", path, response.Status, text)
		}
	}
	expect("/vda5050/nowhere", http.StatusNotFound, "nowhere")
	expect("/vda5050/office/99.zip", http.StatusNotFound, "newest is 3")
	expect("/vda5050/office/03.zip", http.StatusNotFound, "not a revision")
	expect("/vda5050/office/3.tar", http.StatusNotFound, "REVISION.zip")
	expect("/vda5050/office/0.zip", http.StatusNotFound, "no occupancy layer")
	expect("/vda5050/office/3/zoneset.json", http.StatusBadRequest, "layer")
	expect("/vda5050/office/3/zoneset.json?layer=nothing", http.StatusNotFound, "nothing")
	expect("/vda5050/office/3/zoneset.json?layer=floor", http.StatusUnprocessableEntity, "no objects")

	s.call("CatalogService/DeleteLayer", `{"map":"office","layer":"floor"}`)
	expect("/vda5050/office/3.zip", http.StatusGone, "floor")
	s.call("CatalogService/DeleteMap", `{"map":"office"}`)
	s.makeOffice()
	expect(old, http.StatusGone, "others now")
}

func TestVDA5050ForgetsWhatTheServerForgets(t *testing.T) {
	s := site{t, startGateway(t, before(startServer(t, "--history_revisions=2")))}
	s.makeOffice()
	s.edit(putTable)
	s.edit(putTable)
	response, text := s.get("/vda5050/office/1.zip")
	if response.StatusCode != http.StatusGone || !strings.Contains(string(text), "oldest") {
		t.Errorf("%s %s", response.Status, text)
	}
}

// putZone returns the edit that adds a square object to the layer "things".
func putZone(label, attributes string) string {
	return `{"putObject":{"layer":"things","object":{"label":"` + label + `","attributes":{` + attributes + `},
		"shape":{"polygon":{"outer":{"xs":[0,1,1,0],"ys":[0,0,1,1]}}}}}}`
}

func TestVDA5050ZoneSets(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	s.edit(putZone("keepout", ``), putZone("aisle", `"speed_limit":{"doubleValue":0.5}`),
		putZone("one way", `"zone_type":{"stringValue":"DIRECTED"},"direction":{"intValue":0},"limitation":{"stringValue":"strict"}`))
	response, text := s.get("/vda5050/office/4/zoneset.json?layer=things")
	var answer struct {
		ZoneSet struct {
			MapID, ZoneSetID string
			Zones            []map[string]any
		}
	}
	if err := json.Unmarshal(text, &answer); err != nil {
		t.Fatalf("%s: %s", response.Status, text)
	}
	set := answer.ZoneSet
	if set.MapID != "office" || set.ZoneSetID != "office/things/4" || len(set.Zones) != 3 {
		t.Fatalf("zone set %+v", set)
	}
	var types []any
	for _, zone := range set.Zones {
		types = append(types, zone["zoneType"])
		if vertices := zone["vertices"].([]any); len(vertices) != 4 || at(t, vertices, 1, "x") != 1.0 {
			t.Errorf("vertices %v", vertices)
		}
	}
	if !slices.Equal(types, []any{"BLOCKED", "SPEED_LIMIT", "DIRECTED"}) {
		t.Errorf("types %v", types)
	}
	if set.Zones[1]["maximumSpeed"] != 0.5 || set.Zones[2]["directedLimitation"] != "STRICT" || set.Zones[2]["direction"] != 0.0 {
		t.Errorf("zones %v", set.Zones)
	}

	s.edit(putZone("penalty", ``))
	response, text = s.get("/vda5050/office/5/zoneset.json?layer=things")
	if response.StatusCode != http.StatusUnprocessableEntity || !strings.Contains(string(text), "penalty_factor") {
		t.Errorf("a zone without its parameter: %s %s", response.Status, text)
	}
}

func TestVDA5050PassesTheTokenAndKeepsTheFilePrivate(t *testing.T) {
	tokens := make(chan []string, 10)
	server, _ := startBackend(t, "127.0.0.1:0", func(path string, stream grpc.ServerStream) error {
		sent, _ := metadata.FromIncomingContext(stream.Context())
		tokens <- sent.Get("authorization")
		return stream.SendMsg(&message{})
	})
	gateway := startGateway(t, before(server))
	response, _ := send(t, http.DefaultClient, http.MethodGet,
		gateway+"/vda5050/office/0/zoneset.json?layer=zones&incarnation=0&access_token=hm_1_secret", "", nil)
	if sent := <-tokens; !slices.Equal(sent, []string{"Bearer hm_1_secret"}) {
		t.Errorf("the server got %v", sent)
	}
	if got := response.Header.Get("Cache-Control"); got != "private, max-age=31536000, immutable" {
		t.Errorf("Cache-Control %q", got)
	}
}

// If this fails because the format or the compressor has changed, robots that have a file get another one under the
// same mapVersion: say so in the release notes.
func TestVDA5050FilesHaveTheBytesThatTheyAlwaysHad(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	const always = "9d6dd6c64ceea97d803a97e43f6da40c76f2991f156f13438b1a69545f48c397"
	if now := s.newestRelease()["sha256"]; now != always {
		t.Errorf("the file has the hash %s instead of %s", now, always)
	}
}
