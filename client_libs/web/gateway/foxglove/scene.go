package foxglove

import (
	"fmt"
	"io"
	"maps"
	"slices"
	"strconv"
	"strings"
	"time"

	pb "hypermap-gateway/gen/hypermapv1"
)

// Sizes of what has none on the map.
const (
	lineWidthPixels = 3
	pointSize_m     = 0.15
	goalSize_m      = 0.4
	textPixels      = 12
	// bytesPerObject is about the size of an entity without its vertices.
	bytesPerObject = 1024
	bytesPerVertex = 128
)

// Values of foxglove.LinePrimitive.type.
const (
	lineStrip = 0
	lineLoop  = 1
)

// deleteAll is the type of a foxglove.SceneEntityDeletion of all earlier entities of the topic.
const deleteAll = 1

type deletion struct {
	Timestamp timestamp `json:"timestamp"`
	Type      int       `json:"type"`
	ID        string    `json:"id"`
}

// entity is a foxglove.SceneEntity. The schema requires all its fields.
type entity struct {
	Timestamp   timestamp      `json:"timestamp"`
	FrameID     string         `json:"frame_id"`
	ID          string         `json:"id"`
	Lifetime    timestamp      `json:"lifetime"`
	FrameLocked bool           `json:"frame_locked"`
	Metadata    []keyValue     `json:"metadata"`
	Arrows      []struct{}     `json:"arrows"`
	Cubes       []struct{}     `json:"cubes"`
	Spheres     []sphere       `json:"spheres"`
	Cylinders   []struct{}     `json:"cylinders"`
	Lines       []line         `json:"lines"`
	Triangles   []triangleList `json:"triangles"`
	Texts       []text         `json:"texts"`
	Models      []struct{}     `json:"models"`
}

type keyValue struct {
	Key   string `json:"key"`
	Value string `json:"value"`
}

type sphere struct {
	Pose  pose    `json:"pose"`
	Size  vector3 `json:"size"`
	Color colour  `json:"color"`
}

type line struct {
	Type           int       `json:"type"`
	Pose           pose      `json:"pose"`
	Thickness      float64   `json:"thickness"`
	ScaleInvariant bool      `json:"scale_invariant"`
	Points         []vector3 `json:"points"`
	Color          colour    `json:"color"`
	Colors         []colour  `json:"colors"`
	Indices        []uint32  `json:"indices"`
}

type triangleList struct {
	Pose    pose      `json:"pose"`
	Points  []vector3 `json:"points"`
	Color   colour    `json:"color"`
	Colors  []colour  `json:"colors"`
	Indices []uint32  `json:"indices"`
}

type text struct {
	Pose           pose    `json:"pose"`
	Billboard      bool    `json:"billboard"`
	FontSize       float64 `json:"font_size"`
	ScaleInvariant bool    `json:"scale_invariant"`
	Color          colour  `json:"color"`
	Text           string  `json:"text"`
}

// scene is the content of a semantic layer.
type scene struct{ parts []*pb.LayerPart }

// size returns about how many bytes write writes.
func (s scene) size() int64 {
	size := int64(0)
	for object := range s.objects {
		size += bytesPerObject + bytesPerVertex*int64(vertexCount(object.GetShape()))
	}
	return size
}

func (s scene) objects(yield func(*pb.Object) bool) {
	for _, part := range s.parts {
		for _, object := range part.GetObjects() {
			if !yield(object) {
				return
			}
		}
	}
}

// write writes the layer as a foxglove.SceneUpdate that replaces all earlier ones of its topic. It holds one
// object in memory.
func (s scene) write(w io.Writer, frame string, now time.Time) error {
	head := fmt.Sprintf(`{"deletions":[%s],"entities":[`, mustMarshal(deletion{toTimestamp(now), deleteAll, ""}))
	if _, err := io.WriteString(w, head); err != nil {
		return err
	}
	separator := ""
	for object := range s.objects {
		made := mustMarshal(newEntity(object, frame, now))
		if _, err := io.WriteString(w, separator+string(made)); err != nil {
			return err
		}
		separator = ","
	}
	_, err := io.WriteString(w, "]}")
	return err
}

// newEntity draws an object. Explorations are objects, too, and have marks of their own.
func newEntity(object *pb.Object, frame string, now time.Time) *entity {
	made := &entity{
		Timestamp:   toTimestamp(now),
		FrameID:     frame,
		ID:          strconv.FormatInt(object.GetId(), 10),
		FrameLocked: true,
		Metadata:    metadataOf(object),
		Arrows:      []struct{}{},
		Cubes:       []struct{}{},
		Spheres:     []sphere{},
		Cylinders:   []struct{}{},
		Lines:       []line{},
		Triangles:   []triangleList{},
		Texts:       []text{},
		Models:      []struct{}{},
	}
	if mark, ok := markOf(object); ok {
		made.addMark(object, mark)
		return made
	}
	painted := classColour(object.GetLabel())
	// As in the dashboard, objects are the fainter the less likely they are.
	made.addFill(object.GetShape().GetPolygon(), painted.faded(0.15+0.5*object.GetExistence()).colour())
	made.addShape(object.GetShape(), painted.faded(0.3+0.7*object.GetExistence()).colour())
	made.addText(object.GetCentroid(), object.GetLabel(), painted.colour())
	return made
}

func (e *entity) addShape(shape *pb.Shape, painted colour) {
	switch shape := shape.GetShape().(type) {
	case *pb.Shape_Polygon:
		for _, ring := range append([]*pb.Ring{shape.Polygon.GetOuter()}, shape.Polygon.GetHoles()...) {
			e.addLine(lineLoop, pointsOf(ring.GetXs(), ring.GetYs()), painted)
		}
	case *pb.Shape_LineString:
		e.addLine(lineStrip, pointsOf(shape.LineString.GetXs(), shape.LineString.GetYs()), painted)
	case *pb.Shape_Point:
		e.addSphere(shape.Point, pointSize_m, painted)
	}
}

// addFill fills a polygon that has no holes.
func (e *entity) addFill(polygon *pb.Polygon, painted colour) {
	if polygon == nil || len(polygon.GetHoles()) > 0 {
		return
	}
	points := pointsOf(polygon.GetOuter().GetXs(), polygon.GetOuter().GetYs())
	if indices := triangulate(points); indices != nil {
		e.Triangles = append(e.Triangles, triangleList{identity, points, painted, []colour{}, indices})
	}
}

func (e *entity) addLine(kind int, points []vector3, painted colour) {
	e.Lines = append(e.Lines, line{
		Type:           kind,
		Pose:           identity,
		Thickness:      lineWidthPixels,
		ScaleInvariant: true,
		Points:         points,
		Color:          painted,
		Colors:         []colour{},
		Indices:        []uint32{},
	})
}

func (e *entity) addSphere(place *pb.Point, size_m float64, painted colour) {
	e.Spheres = append(e.Spheres, sphere{at(place), vector3{size_m, size_m, size_m}, painted})
}

func (e *entity) addText(place *pb.Point, words string, painted colour) {
	e.Texts = append(e.Texts, text{
		Pose:           at(place),
		Billboard:      true,
		FontSize:       textPixels,
		ScaleInvariant: true,
		Color:          painted,
		Text:           words,
	})
}

// mark is how a part of an exploration is drawn.
type mark struct {
	colour rgba
	// Whether it is a disc rather than the outline of its shape.
	isDisc bool
	text   string
}

// markOf returns the mark of an object that the server's exploration service makes. The colours are those of the
// dashboard.
func markOf(object *pb.Object) (mark, bool) {
	accent, bad := rgba{0x25, 0x60, 0xc9, 255}, rgba{0xc0, 0x30, 0x2b, 255}
	robot := object.GetAttributes()["robot"].GetStringValue()
	switch object.GetLabel() {
	case "exploration":
		return mark{accent, false, "exploration " + object.GetAttributes()["state"].GetStringValue()}, true
	case "exploration goal":
		return mark{accent, true, robot}, true
	case "unreachable place":
		return mark{bad, true, robot}, true
	}
	return mark{}, false
}

func (e *entity) addMark(object *pb.Object, m mark) {
	if m.isDisc {
		e.addSphere(object.GetCentroid(), goalSize_m, m.colour.colour())
	} else {
		e.addShape(object.GetShape(), m.colour.colour())
	}
	e.addText(object.GetCentroid(), m.text, m.colour.colour())
}

// metadataOf describes an object in words. Attributes have the prefix "attribute.", so that keys are unique.
func metadataOf(object *pb.Object) []keyValue {
	metadata := []keyValue{
		{"label", object.GetLabel()},
		{"existence", strconv.FormatFloat(object.GetExistence(), 'g', -1, 64)},
	}
	if height := object.GetHeight(); height != nil {
		metadata = append(metadata, keyValue{"height", fmt.Sprintf("%g to %g m", height.GetLowM(), height.GetHighM())})
	}
	if len(object.GetTags()) > 0 {
		metadata = append(metadata, keyValue{"tags", strings.Join(object.GetTags(), ", ")})
	}
	for _, name := range slices.Sorted(maps.Keys(object.GetAttributes())) {
		metadata = append(metadata, keyValue{"attribute." + name, attributeText(object.GetAttributes()[name])})
	}
	return metadata
}

func attributeText(value *pb.AttributeValue) string {
	switch value := value.GetValue().(type) {
	case *pb.AttributeValue_BoolValue:
		return strconv.FormatBool(value.BoolValue)
	case *pb.AttributeValue_IntValue:
		return strconv.FormatInt(value.IntValue, 10)
	case *pb.AttributeValue_DoubleValue:
		return strconv.FormatFloat(value.DoubleValue, 'g', -1, 64)
	}
	return value.GetStringValue()
}

func vertexCount(shape *pb.Shape) int {
	count := len(shape.GetPolygon().GetOuter().GetXs()) + len(shape.GetLineString().GetXs())
	for _, hole := range shape.GetPolygon().GetHoles() {
		count += len(hole.GetXs())
	}
	return count
}
