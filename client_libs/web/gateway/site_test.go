package main

import (
	"encoding/json"
	"io"
	"net/http"
	"strings"
	"testing"
)

// site is a real server with a gateway in front of it.
type site struct {
	t       *testing.T
	gateway string
}

func startSite(t *testing.T) site {
	t.Helper()
	return site{t, startGateway(t, before(startServer(t)))}
}

// call calls a method of the server with JSON, such as "CatalogService/CreateMap", and returns its answer.
func (s site) call(method, request string) map[string]any {
	s.t.Helper()
	response, err := http.Post(s.gateway+"/hypermap.v1."+method, "application/json", strings.NewReader(request))
	if err != nil {
		s.t.Fatal(err)
	}
	defer response.Body.Close()
	text, err := io.ReadAll(response.Body)
	if err != nil || response.StatusCode != http.StatusOK {
		s.t.Fatalf("%s: %s %s %v", method, response.Status, text, err)
	}
	answer := map[string]any{}
	if err := json.Unmarshal(text, &answer); err != nil {
		s.t.Fatal(err)
	}
	return answer
}

// edit carries out edits of the map "office".
func (s site) edit(edits ...string) {
	s.t.Helper()
	s.call("EditService/ApplyEdits", `{"map":"office","edits":[`+strings.Join(edits, ",")+`]}`)
}

// makeOffice makes the map "office" in three revisions: 1 has a dock's frame, a floor with a free, a half occupied, an
// occupied and an unknown cell, and an empty layer of zones; 2 has a table and 3 a lane.
func (s site) makeOffice() {
	s.t.Helper()
	s.call("CatalogService/CreateMap", `{"map":"office"}`)
	s.edit(`{"setTransform":{"transform":{"parentFrameId":"map","childFrameId":"dock","parentFromChild":{"x":20,"y":1,"yaw":1.5}}}}`,
		`{"createLayer":{"layer":{"name":"floor","kind":"LAYER_KIND_OCCUPANCY","grid":{"origin":{"x":1,"y":2},"resolutionM":0.5}}}}`,
		`{"createLayer":{"layer":{"name":"things","kind":"LAYER_KIND_SEMANTIC"}}}`,
		`{"writeCells":{"layer":"floor","box":{"rowBegin":2,"rowEnd":4,"colBegin":1,"colEnd":3},"values":[0,0.5,1,"NaN"]}}`)
	s.edit(putTable)
	s.edit(`{"putObject":{"layer":"things","object":{"label":"lane","shape":{"lineString":{"xs":[0,4],"ys":[0,3]}}}}}`)
}

const putTable = `{"putObject":{"layer":"things","object":{"label":"table","existence":0.5,"tags":["oak"],
	"attributes":{"legs":{"intValue":4}},
	"shape":{"polygon":{"outer":{"xs":[0,2,2,0],"ys":[0,0,2,2]},"holes":[{"xs":[0.5,0.5,1],"ys":[0.5,1,1]}]}}}}}`
