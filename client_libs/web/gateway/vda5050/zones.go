package vda5050

import (
	"fmt"
	"math"
	"slices"
	"strconv"
	"strings"

	pb "hypermap-gateway/gen/hypermapv1"
)

// zoneSetMessage is the content of VDA 5050's topic zoneSet without the header, which the fleet manager adds.
type zoneSetMessage struct {
	ZoneSet zoneSet `json:"zoneSet"`
}

type zoneSet struct {
	MapID     string `json:"mapId"`
	ZoneSetID string `json:"zoneSetId"`
	Zones     []zone `json:"zones"`
}

type zone struct {
	ZoneID         string   `json:"zoneId"`
	ZoneType       string   `json:"zoneType"`
	ZoneDescriptor string   `json:"zoneDescriptor"`
	Vertices       []vertex `json:"vertices"`
	// Metres per second.
	MaximumSpeed   *float64 `json:"maximumSpeed,omitempty"`
	PriorityFactor *float64 `json:"priorityFactor,omitempty"`
	PenaltyFactor  *float64 `json:"penaltyFactor,omitempty"`
	// Radians.
	Direction            *float64 `json:"direction,omitempty"`
	DirectedLimitation   string   `json:"directedLimitation,omitempty"`
	BidirectedLimitation string   `json:"bidirectedLimitation,omitempty"`
}

type vertex struct {
	X float64 `json:"x"`
	Y float64 `json:"y"`
}

// zoneTypes has the types of zones by words. ACTION is not among them, because objects have no place for actions.
var zoneTypes = map[string]string{
	"blocked":                "BLOCKED",
	"keepout":                "BLOCKED",
	"keep_out":               "BLOCKED",
	"no_go":                  "BLOCKED",
	"line_guided":            "LINE_GUIDED",
	"release":                "RELEASE",
	"coordinated_replanning": "COORDINATED_REPLANNING",
	"speed_limit":            "SPEED_LIMIT",
	"priority":               "PRIORITY",
	"penalty":                "PENALTY",
	"directed":               "DIRECTED",
	"bidirected":             "BIDIRECTED",
}

// zonesOf returns the zones among the objects of a semantic layer. It fails if one of them can't be told whole,
// because a robot that gets a part of the zones would drive where it must not.
func zonesOf(parts []*pb.LayerPart) ([]zone, error) {
	zones := []zone{}
	for _, part := range parts {
		if part.GetStatus() != pb.AnswerStatus_ANSWER_STATUS_VALUE {
			return nil, fmt.Errorf("layer %s can't be read in the frame of the map: %v", part.GetLayer(), part.GetStatus())
		}
		if part.GetKind() != pb.LayerKind_LAYER_KIND_SEMANTIC {
			return nil, fmt.Errorf("layer %s has no objects", part.GetLayer())
		}
		for _, object := range part.GetObjects() {
			kind, err := zoneTypeOf(object)
			if err == nil && kind != "" {
				var made zone
				made, err = newZone(object, kind)
				zones = append(zones, made)
			}
			if err != nil {
				return nil, fmt.Errorf("object %d (%s): %w", object.GetId(), object.GetLabel(), err)
			}
		}
	}
	return zones, nil
}

// zoneTypeOf returns the type of the zone that an object is, or "" if it is none: what its attribute zone_type says,
// SPEED_LIMIT if it has the attribute speed_limit, or else what its label or the first of its tags says.
func zoneTypeOf(object *pb.Object) (string, error) {
	attributes := object.GetAttributes()
	if said := attributes["zone_type"]; said != nil {
		kind := typeOfWord(said.GetStringValue())
		if kind == "" {
			return "", fmt.Errorf("the attribute zone_type is none of %s", strings.Join(knownTypes(), ", "))
		}
		return kind, nil
	}
	if attributes["speed_limit"] != nil {
		return "SPEED_LIMIT", nil
	}
	for _, word := range append([]string{object.GetLabel()}, object.GetTags()...) {
		if kind := typeOfWord(word); kind != "" {
			return kind, nil
		}
	}
	return "", nil
}

// typeOfWord returns the type that a word stands for. Case does not matter, and blanks and dashes count as "_".
func typeOfWord(word string) string {
	return zoneTypes[strings.NewReplacer(" ", "_", "-", "_").Replace(strings.ToLower(strings.TrimSpace(word)))]
}

func knownTypes() []string {
	var known []string
	for _, kind := range zoneTypes {
		known = append(known, kind)
	}
	slices.Sort(known)
	return slices.Compact(known)
}

func newZone(object *pb.Object, kind string) (zone, error) {
	made := zone{ZoneID: strconv.FormatInt(object.GetId(), 10), ZoneType: kind, ZoneDescriptor: object.GetLabel()}
	outer := object.GetShape().GetPolygon().GetOuter()
	if outer == nil {
		return zone{}, fmt.Errorf("a zone is a polygon")
	}
	for i, x := range outer.GetXs() {
		made.Vertices = append(made.Vertices, vertex{x, outer.GetYs()[i]})
	}
	// A hole in a blocked zone is blocked with it; elsewhere it would be free of what the zone says.
	if len(object.GetShape().GetPolygon().GetHoles()) > 0 && kind != "BLOCKED" {
		return zone{}, fmt.Errorf("a zone of the type %s may have no holes", kind)
	}
	return made, made.setParameters(object.GetAttributes())
}

// setParameters sets what the zone's type requires.
func (z *zone) setParameters(attributes map[string]*pb.AttributeValue) (err error) {
	switch z.ZoneType {
	case "SPEED_LIMIT":
		z.MaximumSpeed, err = numberOf(attributes, "speed_limit", 0, math.MaxFloat64)
	case "PRIORITY":
		z.PriorityFactor, err = numberOf(attributes, "priority_factor", 0, 1)
	case "PENALTY":
		z.PenaltyFactor, err = numberOf(attributes, "penalty_factor", 0, 1)
	case "DIRECTED", "BIDIRECTED":
		if z.Direction, err = numberOf(attributes, "direction", -math.MaxFloat64, math.MaxFloat64); err != nil {
			return err
		}
		if z.ZoneType == "DIRECTED" {
			z.DirectedLimitation, err = limitationOf(attributes, "SOFT", "RESTRICTED", "STRICT")
		} else {
			z.BidirectedLimitation, err = limitationOf(attributes, "SOFT", "RESTRICTED")
		}
	}
	return err
}

func numberOf(attributes map[string]*pb.AttributeValue, name string, lowest, highest float64) (*float64, error) {
	var value float64
	switch given := attributes[name].GetValue().(type) {
	case *pb.AttributeValue_DoubleValue:
		value = given.DoubleValue
	case *pb.AttributeValue_IntValue:
		value = float64(given.IntValue)
	default:
		return nil, fmt.Errorf("the attribute %s is missing, or not a number", name)
	}
	if value < lowest || value > highest {
		return nil, fmt.Errorf("the attribute %s is %g, it must be from %g to %g", name, value, lowest, highest)
	}
	return &value, nil
}

func limitationOf(attributes map[string]*pb.AttributeValue, allowed ...string) (string, error) {
	limitation := strings.ToUpper(attributes["limitation"].GetStringValue())
	if !slices.Contains(allowed, limitation) {
		return "", fmt.Errorf("the attribute limitation must be one of %s", strings.Join(allowed, ", "))
	}
	return limitation, nil
}
