package recorder

import (
	"reflect"
	"testing"

	"google.golang.org/protobuf/types/dynamicpb"

	"hypermap-linearizability/history"
)

func loadTestSchema(t *testing.T) *schema {
	t.Helper()
	s, err := loadSchema()
	if err != nil {
		t.Fatal(err)
	}
	return s
}

// answerOf makes the answer of an rpc from JSON.
func answerOf(t *testing.T, s *schema, rpc string, fields object) *dynamicpb.Message {
	t.Helper()
	method, err := s.method(rpc)
	if err != nil {
		t.Fatal(err)
	}
	message, err := encode(method.Output(), fields)
	if err != nil {
		t.Fatal(err)
	}
	return message
}

func TestRequestsFitTheSchema(t *testing.T) {
	s := loadTestSchema(t)
	version := int64(3)
	method, err := s.method("EditService.ApplyEdits")
	if err != nil {
		t.Fatal(err)
	}
	if _, err := encode(method.Input(), encodeEdits(&history.Request{RPC: history.ApplyEdits, ID: "e1", IfLayer: &version, Edits: []history.Edit{
		{Action: history.Create, Place: 1, Value: 5},
		{Action: history.Put, ID: 2, Place: 1, Value: 6, IfVersion: &version},
		{Action: history.Delete, ID: 2, IfVersion: &version},
	}})); err != nil {
		t.Error(err)
	}
	for _, rpc := range []history.RPC{history.QueryPoint, history.QueryArea, history.QueryValue, history.QueryNearest} {
		method, err := s.method("QueryService." + string(rpc))
		if err != nil {
			t.Fatal(err)
		}
		if _, err := encode(method.Input(), encodeQuery(&history.Request{RPC: rpc, AtRevision: &version, MinRevision: 2})); err != nil {
			t.Errorf("%s: %v", rpc, err)
		}
	}
}

func part(revision int64, ids ...int64) object {
	var objects []object
	for _, id := range ids {
		o := objectOf(history.Edit{ID: id, Place: int(id), Value: 10 * id})
		o["version"] = 2
		objects = append(objects, o)
	}
	return object{"revision": revision, "incarnation": "18446744073709551615", "part": object{
		"layer": layerName, "status": "ANSWER_STATUS_VALUE", "objects": objects}}
}

func TestPartsMakeOneAnswer(t *testing.T) {
	s := loadTestSchema(t)
	answer := &history.Answer{}
	for _, fields := range []object{part(7, 1, 2), part(7, 3)} {
		var message queryAnswer
		if err := decode(answerOf(t, s, "QueryService.QueryArea", fields), &message); err != nil {
			t.Fatal(err)
		}
		if err := message.addTo(answer, history.QueryArea); err != nil {
			t.Fatal(err)
		}
	}
	want := &history.Answer{Status: history.OK, Incarnation: 1<<64 - 1, Revision: 7, Objects: []history.Object{
		{ID: 1, Place: 1, Version: 2, Value: 10}, {ID: 2, Place: 2, Version: 2, Value: 20}, {ID: 3, Place: 3, Version: 2, Value: 30}}}
	if !reflect.DeepEqual(answer, want) {
		t.Errorf("got %+v, want %+v", answer, want)
	}
	var message queryAnswer
	if err := decode(answerOf(t, s, "QueryService.QueryArea", part(8, 4)), &message); err != nil {
		t.Fatal(err)
	}
	if err := message.addTo(answer, history.QueryArea); err == nil {
		t.Error("parts of two revisions were taken for one answer")
	}
}

func TestAnAnswerOfAnEditIsDecoded(t *testing.T) {
	s := loadTestSchema(t)
	var message editsAnswer
	if err := decode(answerOf(t, s, "EditService.ApplyEdits", object{"revision": 4, "objectIds": []int64{5, 0}, "incarnation": 9}), &message); err != nil {
		t.Fatal(err)
	}
	answer, err := message.decode()
	want := &history.Answer{Status: history.OK, Incarnation: 9, Revision: 4, ObjectIDs: []int64{5, 0}}
	if err != nil || !reflect.DeepEqual(answer, want) {
		t.Errorf("got %+v, %v, want %+v", answer, err, want)
	}
}
