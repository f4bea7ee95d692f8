package foxglove

import (
	"time"

	pb "hypermap-gateway/gen/hypermapv1"
)

// publishInterval is the least time between two messages of a channel.
const publishInterval = 250 * time.Millisecond

// paced is something that is sent again after changes, but not too often.
type paced struct {
	isDue     bool
	notBefore time.Time
}

// began tells that it is being sent, and is due again after the next change.
func (p *paced) began() { p.isDue = false }

// ended tells that it was sent. It rests for at least as long as that took, which is long for large content.
func (p *paced) ended(took time.Duration) { p.notBefore = time.Now().Add(max(publishInterval, took)) }

// retry tells that it could not be sent.
func (p *paced) retry() { p.isDue, p.notBefore = true, time.Now().Add(retryAfter) }

// channel is a layer, or the frame tree.
type channel struct {
	paced
	id    uint32
	topic string
	// The layer, or nil for the frame tree.
	layer *pb.Layer
	// The client's subscription, or nil.
	subscription *uint32
}

const transformsTopic = "/transforms"

// topicOf returns the topic of a layer.
func topicOf(layer *pb.Layer) string {
	if hasCells(layer) {
		return "/grids/" + layer.GetName()
	}
	return "/objects/" + layer.GetName()
}

func hasCells(layer *pb.Layer) bool { return layer.GetProperties().GetHasCells() }

func (c *channel) advertised() advertisedChannel {
	schemaName, schema := "foxglove.SceneUpdate", sceneSchema
	switch {
	case c.layer == nil:
		schemaName, schema = "foxglove.FrameTransforms", transformsSchema
	case hasCells(c.layer):
		schemaName, schema = "foxglove.Grid", gridSchema
	}
	return advertisedChannel{
		ID:             c.id,
		Topic:          c.topic,
		Encoding:       "json",
		SchemaName:     schemaName,
		Schema:         schema,
		SchemaEncoding: "jsonschema",
	}
}

// unlisted describes a layer of a past revision that the newest one has no more. Only its kind is known.
func unlisted(name string, kind pb.LayerKind) *pb.Layer {
	properties := &pb.LayerProperties{}
	switch kind {
	case pb.LayerKind_LAYER_KIND_SEMANTIC:
		properties.HasShapes = true
	case pb.LayerKind_LAYER_KIND_OCCUPANCY:
		properties.HasCells = true
		properties.Words = []string{"free", "occupied"}
		properties.ValueRange = &pb.ValueRange{Max: 1}
	case pb.LayerKind_LAYER_KIND_EXPLORATION:
		properties.HasCells, properties.IsBinary = true, true
	default:
		properties.HasCells = true
	}
	return &pb.Layer{Name: name, Kind: kind, Properties: properties}
}
