package main

import (
	"context"
	"encoding/base64"
	"encoding/binary"
	"encoding/json"
	"fmt"
	"math"
	"net/http"
	"slices"
	"strings"
	"testing"
	"time"

	"github.com/coder/websocket"
	"google.golang.org/grpc"
	"google.golang.org/grpc/metadata"
)

// viewer is a client of Foxglove's protocol.
type viewer struct {
	t    *testing.T
	ctx  context.Context
	conn *websocket.Conn
	// Channels by topic.
	channels map[string]uint32
	schemas  map[string]string
}

func dialFoxglove(ctx context.Context, gateway, path string, options *websocket.DialOptions) (*websocket.Conn, *http.Response, error) {
	return websocket.Dial(ctx, strings.Replace(gateway, "http", "ws", 1)+path, options)
}

// view connects to the map "office" and waits for the topic.
func view(t *testing.T, gateway, subprotocol, topic string) *viewer {
	t.Helper()
	ctx := testContext(t)
	conn, _, err := dialFoxglove(ctx, gateway, "/foxglove/office", &websocket.DialOptions{Subprotocols: []string{subprotocol}})
	if err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { _ = conn.CloseNow() })
	conn.SetReadLimit(-1)
	if conn.Subprotocol() != subprotocol {
		t.Errorf("subprotocol %q instead of %q", conn.Subprotocol(), subprotocol)
	}
	v := &viewer{t, ctx, conn, map[string]uint32{}, map[string]string{}}
	if info := v.next("serverInfo"); info["name"] != "hypermap: office" {
		t.Errorf("server info %v", info)
	}
	for v.channels[topic] == 0 {
		v.next("advertise")
	}
	return v
}

// next returns the next message with the operation, which is not content.
func (v *viewer) next(op string) map[string]any {
	v.t.Helper()
	for {
		kind, data, err := v.conn.Read(v.ctx)
		if err != nil {
			v.t.Fatalf("waiting for %s: %v", op, err)
		}
		if kind != websocket.MessageText {
			continue
		}
		if message := v.note(data); message["op"] == op {
			return message
		}
	}
}

// note parses a message that is not content, and keeps the channels.
func (v *viewer) note(data []byte) map[string]any {
	v.t.Helper()
	message := map[string]any{}
	if err := json.Unmarshal(data, &message); err != nil {
		v.t.Fatal(err)
	}
	if message["op"] == "advertise" {
		for _, channel := range message["channels"].([]any) {
			channel := channel.(map[string]any)
			v.channels[channel["topic"].(string)] = uint32(channel["id"].(float64))
			v.schemas[channel["topic"].(string)] = channel["schemaName"].(string)
		}
	}
	return message
}

func (v *viewer) send(format string, arguments ...any) {
	v.t.Helper()
	if err := v.conn.Write(v.ctx, websocket.MessageText, fmt.Appendf(nil, format, arguments...)); err != nil {
		v.t.Fatal(err)
	}
}

// subscribe subscribes to a topic, with the channel's number as that of the subscription.
func (v *viewer) subscribe(topic string) uint32 {
	v.t.Helper()
	id := v.channels[topic]
	v.send(`{"op":"subscribe","subscriptions":[{"id":%d,"channelId":%d}]}`, id, id)
	return id
}

// content returns the next content of a subscription that `accept` accepts.
func (v *viewer) content(subscription uint32, accept func(map[string]any) bool) map[string]any {
	v.t.Helper()
	for {
		kind, data, err := v.conn.Read(v.ctx)
		if err != nil {
			v.t.Fatalf("waiting for content: %v", err)
		}
		if kind == websocket.MessageText {
			v.note(data)
			continue
		}
		if data[0] != 1 || binary.LittleEndian.Uint32(data[1:]) != subscription {
			continue
		}
		if binary.LittleEndian.Uint64(data[5:]) == 0 {
			v.t.Error("the content has no time")
		}
		content := map[string]any{}
		if err := json.Unmarshal(data[13:], &content); err != nil {
			v.t.Fatalf("%v in %.200s", err, data[13:])
		}
		if accept(content) {
			return content
		}
	}
}

func anything(map[string]any) bool { return true }

// cellsOf returns the values of a foxglove.Grid and whether each cell is drawn.
func cellsOf(t *testing.T, grid map[string]any) (values []float64, drawn []bool) {
	t.Helper()
	data, err := base64.StdEncoding.DecodeString(grid["data"].(string))
	if err != nil {
		t.Fatal(err)
	}
	for ; len(data) > 0; data = data[8:] {
		values = append(values, float64(math.Float32frombits(binary.LittleEndian.Uint32(data))))
		drawn = append(drawn, data[7] > 0)
	}
	return values, drawn
}

// labelsOf returns the labels of a foxglove.SceneUpdate.
func labelsOf(scene map[string]any) []string {
	var labels []string
	for _, entity := range scene["entities"].([]any) {
		texts := entity.(map[string]any)["texts"].([]any)
		labels = append(labels, texts[0].(map[string]any)["text"].(string))
	}
	return labels
}

func at(t *testing.T, value any, path ...any) any {
	t.Helper()
	for _, step := range path {
		switch step := step.(type) {
		case string:
			value = value.(map[string]any)[step]
		case int:
			value = value.([]any)[step]
		}
	}
	return value
}

func TestFoxgloveShowsAGridAndItsChanges(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	for _, subprotocol := range []string{"foxglove.websocket.v1", "foxglove.sdk.v1"} {
		v := view(t, s.gateway, subprotocol, "/grids/floor")
		if v.schemas["/grids/floor"] != "foxglove.Grid" {
			t.Errorf("schema %s", v.schemas["/grids/floor"])
		}
		subscription := v.subscribe("/grids/floor")
		grid := v.content(subscription, anything)
		if grid["column_count"] != 2.0 || at(t, grid, "cell_size", "x") != 0.5 || grid["frame_id"] != "map" {
			t.Errorf("grid %v", grid)
		}
		// The corner of row 2 and column 1 of a grid at (1, 2).
		if at(t, grid, "pose", "position", "x") != 1.5 || at(t, grid, "pose", "position", "y") != 3.0 {
			t.Errorf("pose %v", grid["pose"])
		}
		values, drawn := cellsOf(t, grid)
		if !slices.Equal(values[:3], []float64{0, 0.5, 1}) || !math.IsNaN(values[3]) ||
			!slices.Equal(drawn, []bool{true, true, true, false}) {
			t.Errorf("values %v, drawn %v", values, drawn)
		}
		s.edit(`{"writeCells":{"layer":"floor","box":{"rowBegin":2,"rowEnd":3,"colBegin":1,"colEnd":2},"values":[0.75]}}`)
		v.content(subscription, func(grid map[string]any) bool {
			values, _ := cellsOf(t, grid)
			return values[0] == 0.75
		})
		s.edit(`{"writeCells":{"layer":"floor","box":{"rowBegin":2,"rowEnd":3,"colBegin":1,"colEnd":2},"values":[0]}}`)
	}
}

func TestFoxgloveShowsObjectsAndFrames(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	scene := v.content(v.subscribe("/objects/things"), anything)
	if labels := labelsOf(scene); !slices.Equal(labels, []string{"table", "lane"}) {
		t.Errorf("labels %v", labels)
	}
	if at(t, scene, "deletions", 0, "type") != 1.0 {
		t.Error("what was shown before stays")
	}
	table, lane := at(t, scene, "entities", 0), at(t, scene, "entities", 1)
	if lines := at(t, table, "lines").([]any); len(lines) != 2 || at(t, lines[0], "type") != 1.0 || len(at(t, lines[1], "points").([]any)) != 3 {
		t.Errorf("the lines of a polygon with a hole: %v", lines)
	}
	if alpha := at(t, table, "lines", 0, "color", "a"); alpha != 0.651 {
		t.Errorf("a table that may not exist has the opacity %v", alpha)
	}
	if at(t, lane, "lines", 0, "type") != 0.0 || at(t, lane, "lines", 0, "points", 1, "y") != 3.0 {
		t.Errorf("the line of a line string: %v", lane)
	}
	told := map[string]any{}
	for _, pair := range at(t, table, "metadata").([]any) {
		told[at(t, pair, "key").(string)] = at(t, pair, "value")
	}
	if told["label"] != "table" || told["existence"] != "0.5" || told["tags"] != "oak" || told["attribute.legs"] != "4" {
		t.Errorf("metadata %v", told)
	}

	transforms := v.content(v.subscribe("/transforms"), anything)
	edge := at(t, transforms, "transforms", 0)
	if at(t, edge, "parent_frame_id") != "map" || at(t, edge, "child_frame_id") != "dock" ||
		at(t, edge, "translation", "x") != 20.0 || at(t, edge, "rotation", "w") != math.Cos(0.75) {
		t.Errorf("transform %v", edge)
	}
	s.edit(`{"setTransform":{"transform":{"parentFrameId":"map","childFrameId":"dock","parentFromChild":{"x":7}}}}`)
	v.content(v.channels["/transforms"], func(content map[string]any) bool {
		return at(t, content, "transforms", 0, "translation", "x") == 7.0
	})
}

func TestFoxgloveTellsOfLayersThatComeAndGo(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	v := view(t, s.gateway, "foxglove.websocket.v1", "/objects/things")
	s.call("CatalogService/CreateLayer", `{"map":"office","layer":{"name":"zones","kind":"LAYER_KIND_SEMANTIC"}}`)
	for v.channels["/objects/zones"] == 0 {
		v.next("advertise")
	}
	s.call("CatalogService/DeleteLayer", `{"map":"office","layer":"things"}`)
	if gone := v.next("unadvertise"); at(t, gone, "channelIds", 0) != float64(v.channels["/objects/things"]) {
		t.Errorf("gone: %v", gone)
	}
}

func TestFoxgloveShowsThePast(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	s.edit(`{"setTransform":{"transform":{"parentFrameId":"map","childFrameId":"dock","parentFromChild":{"x":7}}}}`,
		`{"createLayer":{"layer":{"name":"newer","kind":"LAYER_KIND_SEMANTIC"}}}`)
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	objects := v.subscribe("/objects/things")
	shows := func(labels ...string) func(map[string]any) bool {
		return func(scene map[string]any) bool { return slices.Equal(labelsOf(scene), labels) }
	}
	v.content(objects, shows("table", "lane"))

	v.send(`{"op":"setParameters","parameters":[{"name":"as_of_revision","value":2}],"id":"past"}`)
	if told := v.next("parameterValues"); told["id"] != "past" || at(t, told, "parameters", 0, "value") != 2.0 {
		t.Errorf("told %v", told)
	}
	v.content(objects, shows("table"))
	frames := v.subscribe("/transforms")
	v.content(frames, func(content map[string]any) bool {
		return at(t, content, "transforms", 0, "translation", "x") == 20.0
	})

	v.send(`{"op":"setParameters","parameters":[{"name":"as_of_revision","value":99}]}`)
	if told := v.next("status"); told["level"] != 2.0 || !strings.Contains(told["message"].(string), "99") {
		t.Errorf("told %v", told)
	}
	v.send(`{"op":"setParameters","parameters":[{"name":"as_of_time","value":"1999-01-01T00:00:00Z"}]}`)
	if told := v.next("status"); !strings.Contains(told["message"].(string), "oldest kept revision 0") {
		t.Errorf("told %v", told)
	}
	newer := v.channels["/objects/newer"]
	v.send(`{"op":"setParameters","parameters":[{"name":"as_of_revision","value":0}]}`)
	v.content(objects, shows("table", "lane"))
	if v.channels["/objects/newer"] == newer {
		t.Error("a newer layer was there in the past")
	}
}

func TestFoxgloveTellsTheNewestRevision(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	v.send(`{"op":"subscribeParameterUpdates","parameterNames":["revision"]}`)
	s.edit(putTable)
	for told := 0.0; told != 4; told = at(t, v.next("parameterValues"), "parameters", 0, "value").(float64) {
	}
	v.send(`{"op":"getParameters","parameterNames":[],"id":"all"}`)
	for told := v.next("parameterValues"); ; told = v.next("parameterValues") {
		if told["id"] == "all" {
			if len(told["parameters"].([]any)) != 3 {
				t.Errorf("told %v", told)
			}
			return
		}
	}
}

func TestFoxgloveSendsTheNewestOfManyChanges(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	objects := v.subscribe("/objects/things")
	const changes = 200
	for range changes {
		s.edit(putTable)
	}
	messages := 0
	v.content(objects, func(scene map[string]any) bool {
		messages++
		return len(labelsOf(scene)) == changes+2
	})
	if messages > changes/4 {
		t.Errorf("%d messages for %d changes", messages, changes)
	}
}

func TestFoxgloveSendsTheNewestToAClientThatReadsLate(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	// A message of this grid does not fit into the buffers between the gateway and its client.
	s.edit(`{"createLayer":{"layer":{"name":"wide","kind":"LAYER_KIND_SCALAR","grid":{"resolutionM":0.1}}}}`,
		`{"fillPolygon":{"layer":"wide","value":1,"area":{"outer":{"xs":[0,100,100,0],"ys":[0,0,150,150]}}}}`)
	v := view(t, s.gateway, "foxglove.sdk.v1", "/grids/wide")
	wide := v.subscribe("/grids/wide")
	const changes = 20
	for i := range changes {
		s.edit(fmt.Sprintf(`{"writeCells":{"layer":"wide","box":{"rowEnd":1,"colEnd":1},"values":[%d]}}`, i))
	}
	messages := 0
	v.content(wide, func(grid map[string]any) bool {
		messages++
		values, _ := cellsOf(t, grid)
		return values[0] == changes-1
	})
	if messages > 4 {
		t.Errorf("%d messages", messages)
	}
}

func TestFoxgloveSubscriptionsEndAndBeginAnew(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	things := v.subscribe("/objects/things")
	v.content(things, anything)
	v.send(`{"op":"unsubscribe","subscriptionIds":[%d]}`, things)
	s.edit(putTable)
	v.send(`{"op":"subscribe","subscriptions":[{"id":77,"channelId":%d}]}`, things)
	if labels := labelsOf(v.content(77, anything)); len(labels) != 3 {
		t.Errorf("labels %v", labels)
	}
}

func TestFoxgloveRefusesWhatItShould(t *testing.T) {
	s := startSite(t)
	s.makeOffice()
	ours := []string{"foxglove.sdk.v1"}
	for _, c := range []struct {
		name, path   string
		subprotocols []string
		header       http.Header
		status       int
	}{
		{"an unknown map", "/foxglove/nowhere", ours, nil, http.StatusNotFound},
		{"another subprotocol", "/foxglove/office", []string{"chat"}, nil, http.StatusUpgradeRequired},
		{"a page of another site", "/foxglove/office", ours, http.Header{"Origin": {"http://evil.example"}}, http.StatusForbidden},
	} {
		_, response, err := dialFoxglove(testContext(t), s.gateway, c.path,
			&websocket.DialOptions{Subprotocols: c.subprotocols, HTTPHeader: c.header})
		if err == nil || response.StatusCode != c.status {
			t.Errorf("%s: %v, %v", c.name, response, err)
		}
	}
	v := view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	for _, wrong := range []string{
		`{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}`,
		`{"op":"advertise","channels":[]}`,
		`no JSON`,
		`{"op":"setParameters","parameters":[{"name":"revision","value":1}]}`,
		`{"op":"setParameters","parameters":[{"name":"as_of_revision","value":1.5}]}`,
		`{"op":"setParameters","parameters":[{"name":"as_of_time","value":"yesterday"}]}`,
	} {
		v.send("%s", wrong)
		v.next("status")
	}
	s.call("CatalogService/DeleteMap", `{"map":"office"}`)
	for {
		if _, _, err := v.conn.Read(v.ctx); err != nil {
			if websocket.CloseStatus(err) != websocket.StatusPolicyViolation {
				t.Errorf("the map was deleted: %v", err)
			}
			return
		}
	}
}

func TestFoxgloveCountsAsAWatch(t *testing.T) {
	cfg := before(startServer(t))
	cfg.limits.maxWatches, cfg.limits.addressShare = 1, 100
	s := site{t, startGateway(t, cfg)}
	s.makeOffice()
	view(t, s.gateway, "foxglove.sdk.v1", "/objects/things")
	_, response, err := dialFoxglove(testContext(t), s.gateway, "/foxglove/office",
		&websocket.DialOptions{Subprotocols: []string{"foxglove.sdk.v1"}})
	if err == nil || response.StatusCode != http.StatusServiceUnavailable {
		t.Errorf("a second watch: %v, %v", response, err)
	}
}

func TestFoxgloveEndsWithAClientThatGivesNoSignOfLife(t *testing.T) {
	cfg := before(startServer(t))
	cfg.limits.maxWatches, cfg.limits.addressShare = 1, 100
	cfg.limits.pingAfter, cfg.limits.patience = 100*time.Millisecond, 500*time.Millisecond
	s := site{t, startGateway(t, cfg)}
	s.call("CatalogService/CreateMap", `{"map":"office"}`)
	options := &websocket.DialOptions{Subprotocols: []string{"foxglove.sdk.v1"}}
	silent, _, err := dialFoxglove(testContext(t), s.gateway, "/foxglove/office", options)
	if err != nil {
		t.Fatal(err)
	}
	defer silent.CloseNow()
	for {
		next, response, err := dialFoxglove(testContext(t), s.gateway, "/foxglove/office", options)
		if err == nil {
			_ = next.CloseNow()
			return
		}
		if response == nil || response.StatusCode != http.StatusServiceUnavailable {
			t.Fatal(err)
		}
	}
}

func TestFoxglovePassesTheTokenOfTheURL(t *testing.T) {
	tokens := make(chan []string, 1)
	server, _ := startBackend(t, "127.0.0.1:0", func(_ string, stream grpc.ServerStream) error {
		sent, _ := metadata.FromIncomingContext(stream.Context())
		tokens <- sent.Get("authorization")
		return stream.SendMsg(&message{})
	})
	gateway := startGateway(t, before(server))
	response, err := http.Get(gateway + "/foxglove/office?access_token=hm_1_secret")
	if err != nil {
		t.Fatal(err)
	}
	defer response.Body.Close()
	if sent := <-tokens; !slices.Equal(sent, []string{"Bearer hm_1_secret"}) {
		t.Errorf("the server got %v", sent)
	}
}

func TestFoxgloveEndsWithTheGateway(t *testing.T) {
	server := startServer(t)
	ctx := testContext(t)
	var conn *websocket.Conn
	t.Run("AConnectionIsOpen", func(t *testing.T) {
		s := site{t, startGateway(t, before(server))}
		s.makeOffice()
		opened, _, err := dialFoxglove(ctx, s.gateway, "/foxglove/office", &websocket.DialOptions{Subprotocols: []string{"foxglove.sdk.v1"}})
		if err != nil {
			t.Fatal(err)
		}
		conn = opened
	})
	defer conn.CloseNow()
	for {
		if _, _, err := conn.Read(ctx); err != nil {
			if ctx.Err() != nil {
				t.Error("the connection outlives the gateway")
			}
			return
		}
	}
}
