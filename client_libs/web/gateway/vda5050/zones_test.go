package vda5050

import (
	"strings"
	"testing"

	pb "hypermap-gateway/gen/hypermapv1"
)

type attributes = map[string]*pb.AttributeValue

func word(text string) *pb.AttributeValue {
	return &pb.AttributeValue{Value: &pb.AttributeValue_StringValue{StringValue: text}}
}

func real(value float64) *pb.AttributeValue {
	return &pb.AttributeValue{Value: &pb.AttributeValue_DoubleValue{DoubleValue: value}}
}

func triangle(holes ...*pb.Ring) *pb.Shape {
	outer := &pb.Ring{Xs: []float64{0, 9, 0}, Ys: []float64{0, 0, 9}}
	return &pb.Shape{Shape: &pb.Shape_Polygon{Polygon: &pb.Polygon{Outer: outer, Holes: holes}}}
}

func layerOf(object *pb.Object) []*pb.LayerPart {
	return []*pb.LayerPart{{
		Kind:    pb.LayerKind_LAYER_KIND_SEMANTIC,
		Status:  pb.AnswerStatus_ANSWER_STATUS_VALUE,
		Objects: []*pb.Object{object},
	}}
}

func TestTypesOfZones(t *testing.T) {
	for _, c := range []struct {
		object *pb.Object
		// Empty: no zone.
		kind string
	}{
		{&pb.Object{Label: "chair"}, ""},
		{&pb.Object{Label: "blocked"}, "BLOCKED"},
		{&pb.Object{Label: " Keep-Out"}, "BLOCKED"},
		{&pb.Object{Label: "no go"}, "BLOCKED"},
		{&pb.Object{Label: "stairs", Tags: []string{"steep", "keepout"}}, "BLOCKED"},
		{&pb.Object{Label: "line guided"}, "LINE_GUIDED"},
		{&pb.Object{Label: "hall", Attributes: attributes{"speed_limit": real(1)}}, "SPEED_LIMIT"},
		{&pb.Object{Label: "keepout", Attributes: attributes{"zone_type": word("RELEASE")}}, "RELEASE"},
		{&pb.Object{Label: "penalty", Attributes: attributes{"penalty_factor": real(1)}}, "PENALTY"},
		{&pb.Object{Label: "x", Attributes: attributes{"zone_type": word("bidirected"), "direction": real(1), "limitation": word("soft")}}, "BIDIRECTED"},
	} {
		c.object.Shape = triangle()
		zones, err := zonesOf(layerOf(c.object))
		if err != nil {
			t.Errorf("%s: %v", c.object.GetLabel(), err)
		} else if c.kind == "" && len(zones) > 0 || c.kind != "" && (len(zones) != 1 || zones[0].ZoneType != c.kind) {
			t.Errorf("%s: %v instead of %q", c.object.GetLabel(), zones, c.kind)
		}
	}
}

func TestZonesThatCantBeToldWhole(t *testing.T) {
	hole := &pb.Ring{Xs: []float64{1, 1, 2}, Ys: []float64{1, 2, 1}}
	line := &pb.Shape{Shape: &pb.Shape_LineString{LineString: &pb.LineString{Xs: []float64{0, 1}, Ys: []float64{0, 1}}}}
	for _, c := range []struct {
		object *pb.Object
		// A word of the error. Empty: none.
		wrong string
	}{
		{&pb.Object{Label: "blocked", Shape: line}, "polygon"},
		{&pb.Object{Label: "chair", Shape: line}, ""},
		{&pb.Object{Label: "blocked", Shape: triangle(hole)}, ""},
		{&pb.Object{Label: "release", Shape: triangle(hole)}, "holes"},
		{&pb.Object{Label: "x", Shape: triangle(), Attributes: attributes{"zone_type": word("ACTION")}}, "zone_type"},
		{&pb.Object{Label: "x", Shape: triangle(), Attributes: attributes{"speed_limit": word("slow")}}, "speed_limit"},
		{&pb.Object{Label: "x", Shape: triangle(), Attributes: attributes{"speed_limit": real(-1)}}, "speed_limit"},
		{&pb.Object{Label: "priority", Shape: triangle(), Attributes: attributes{"priority_factor": real(2)}}, "priority_factor"},
		{&pb.Object{Label: "directed", Shape: triangle(), Attributes: attributes{"direction": real(2)}}, "limitation"},
		{&pb.Object{Label: "bidirected", Shape: triangle(), Attributes: attributes{"direction": real(2), "limitation": word("STRICT")}}, "limitation"},
	} {
		c.object.Id = 7
		_, err := zonesOf(layerOf(c.object))
		if (err == nil) != (c.wrong == "") || err != nil && (!strings.Contains(err.Error(), c.wrong) || !strings.Contains(err.Error(), "object 7")) {
			t.Errorf("%s: %v", c.object.GetLabel(), err)
		}
	}
}
