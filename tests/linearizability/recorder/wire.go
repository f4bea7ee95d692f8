package recorder

import (
	"cmp"
	"fmt"
	"math"
	"slices"
	"strconv"

	"hypermap-linearizability/history"
)

// The map on which the clients work: one semantic layer with point objects at a few places.
const (
	mapName   = "site"
	layerName = "things"
	label     = "thing"
	// Distance of neighbouring places. QueryPoint finds the objects of one place.
	spacingM   = 10.0
	toleranceM = 1.0
)

func pointOf(place int) object { return object{"x": float64(place) * spacingM, "y": 0} }

func scope() object { return object{"map": mapName, "layers": []string{layerName}} }

// everywhere is an area that has all places in it.
func everywhere() object {
	return object{"outer": object{"xs": []float64{-1e4, 1e4, 1e4, -1e4}, "ys": []float64{-1e4, -1e4, 1e4, 1e4}}}
}

func objectOf(edit history.Edit) object {
	return object{
		"id":         edit.ID,
		"label":      label,
		"shape":      object{"point": pointOf(edit.Place)},
		"attributes": object{"value": object{"intValue": edit.Value}},
	}
}

func encodeEdit(edit history.Edit) object {
	fields := object{"layer": layerName}
	if edit.IfVersion != nil {
		fields["ifVersion"] = *edit.IfVersion
	}
	if edit.Action == history.Delete {
		fields["id"] = edit.ID
		return object{"deleteObject": fields}
	}
	fields["object"] = objectOf(edit)
	return object{"putObject": fields}
}

func encodeEdits(request *history.Request) object {
	edits := make([]object, len(request.Edits))
	for i, edit := range request.Edits {
		edits[i] = encodeEdit(edit)
	}
	fields := object{"map": mapName, "requestId": request.ID, "edits": edits}
	if request.IfLayer != nil {
		fields["ifLayers"] = []object{{"layer": layerName, "version": *request.IfLayer}}
	}
	return fields
}

func encodeQuery(request *history.Request) object {
	fields := object{"scope": scope()}
	asOf := object{}
	if request.AtRevision != nil {
		asOf["atRevision"] = *request.AtRevision
	}
	if request.MinRevision > 0 {
		asOf["minRevision"] = request.MinRevision
	}
	if request.Linearizable {
		asOf["consistency"] = "CONSISTENCY_LINEARIZABLE"
	}
	if len(asOf) > 0 {
		fields["asOf"] = asOf
	}
	switch request.RPC {
	case history.QueryPoint:
		fields["point"], fields["toleranceM"] = pointOf(request.Place), toleranceM
	case history.QueryArea:
		fields["area"] = everywhere()
	case history.QueryValue:
		fields["value"] = label
	case history.QueryNearest:
		// There are never so many objects.
		fields["point"], fields["value"], fields["k"] = pointOf(0), label, 1000
	}
	return fields
}

// The answers, with those of their fields that matter here. Protobuf's JSON has 64-bit numbers as
// strings.

type editsAnswer struct {
	Revision    int64    `json:"revision,string"`
	ObjectIDs   []string `json:"objectIds"`
	Incarnation uint64   `json:"incarnation,string"`
}

type mapAnswer struct {
	Map struct {
		Revision    int64  `json:"revision,string"`
		Incarnation uint64 `json:"incarnation,string"`
	} `json:"map"`
}

// queryAnswer is a message of any query: QueryPoint has layers, QueryArea and QueryValue have parts, and
// QueryNearest has matches.
type queryAnswer struct {
	Revision    int64          `json:"revision,string"`
	Incarnation uint64         `json:"incarnation,string"`
	Layers      []layerContent `json:"layers"`
	Part        *layerContent  `json:"part"`
	Matches     []struct {
		Object objectAnswer `json:"object"`
	} `json:"matches"`
	Refusals []object `json:"refusals"`
}

type layerContent struct {
	Layer   string         `json:"layer"`
	Status  string         `json:"status"`
	Objects []objectAnswer `json:"objects"`
}

// objects returns the objects of a message.
func (a *queryAnswer) objects(rpc history.RPC) ([]objectAnswer, error) {
	layers := a.Layers
	switch {
	case rpc == history.QueryNearest:
		objects := make([]objectAnswer, len(a.Matches))
		for i := range a.Matches {
			objects[i] = a.Matches[i].Object
		}
		if len(a.Refusals) > 0 {
			return nil, fmt.Errorf("a layer can't answer: %v", a.Refusals)
		}
		return objects, nil
	case a.Part != nil:
		layers = []layerContent{*a.Part}
	}
	if len(layers) != 1 || layers[0].Layer != layerName || layers[0].Status != "ANSWER_STATUS_VALUE" {
		return nil, fmt.Errorf("an answer is not of the layer that was asked: %+v", layers)
	}
	return layers[0].Objects, nil
}

type objectAnswer struct {
	ID      int64 `json:"id,string"`
	Version int64 `json:"version,string"`
	Shape   struct {
		Point *struct{ X, Y float64 } `json:"point"`
	} `json:"shape"`
	Attributes struct {
		Value struct {
			IntValue int64 `json:"intValue,string"`
		} `json:"value"`
	} `json:"attributes"`
}

func (a *editsAnswer) decode() (*history.Answer, error) {
	ids := make([]int64, len(a.ObjectIDs))
	for i, text := range a.ObjectIDs {
		id, err := strconv.ParseInt(text, 10, 64)
		if err != nil {
			return nil, err
		}
		ids[i] = id
	}
	return &history.Answer{Status: history.OK, Revision: a.Revision, Incarnation: a.Incarnation, ObjectIDs: ids}, nil
}

func (o *objectAnswer) decode() (history.Object, error) {
	if o.Shape.Point == nil {
		return history.Object{}, fmt.Errorf("object %d is not a point", o.ID)
	}
	place := math.Round(o.Shape.Point.X / spacingM)
	if place*spacingM != o.Shape.Point.X || o.Shape.Point.Y != 0 {
		return history.Object{}, fmt.Errorf("object %d is at no place: %v", o.ID, *o.Shape.Point)
	}
	return history.Object{ID: o.ID, Place: int(place), Version: o.Version, Value: o.Attributes.Value.IntValue}, nil
}

// addTo adds a message to the answer of its call. All messages of a call must be of one revision.
func (a *queryAnswer) addTo(answer *history.Answer, rpc history.RPC) error {
	if answer.Status == "" {
		answer.Status, answer.Revision, answer.Incarnation = history.OK, a.Revision, a.Incarnation
	}
	if answer.Revision != a.Revision || answer.Incarnation != a.Incarnation {
		return fmt.Errorf("parts of one answer are of revisions %d and %d", answer.Revision, a.Revision)
	}
	objects, err := a.objects(rpc)
	if err != nil {
		return err
	}
	for i := range objects {
		decoded, err := objects[i].decode()
		if err != nil {
			return err
		}
		answer.Objects = append(answer.Objects, decoded)
	}
	if rpc == history.QueryNearest { // The nearest comes first.
		slices.SortFunc(answer.Objects, func(a, b history.Object) int { return cmp.Compare(a.ID, b.ID) })
	}
	return nil
}
