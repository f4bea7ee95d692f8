package recorder

import (
	"maps"
	"math/rand/v2"
	"slices"
	"sync"

	"hypermap-linearizability/history"
)

// knowledge is what the clients of a history have learned from answers. It serves only to choose
// requests that contend, so it may be out of date.
type knowledge struct {
	mutex    sync.Mutex
	newest   int64
	objects  map[int64]history.Object
	requests []*history.Request
	values   int64
	ids      int64
}

// rememberedRequests is the number of the newest edits that other clients may send again.
const rememberedRequests = 32

func newKnowledge(initial history.Map) *knowledge {
	k := &knowledge{newest: initial.Revision, objects: map[int64]history.Object{}}
	for _, object := range initial.Objects {
		k.objects[object.ID] = object
		k.values = max(k.values, object.Value)
	}
	return k
}

// newestRevision returns the newest revision that an answer has named.
func (k *knowledge) newestRevision() int64 {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	return k.newest
}

// objectAt returns a random object at a place, and false if none is known there.
func (k *knowledge) objectAt(place int, random *rand.Rand) (history.Object, bool) {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	var there []history.Object
	for _, id := range slices.Sorted(maps.Keys(k.objects)) {
		if object := k.objects[id]; object.Place == place {
			there = append(there, object)
		}
	}
	if len(there) == 0 {
		return history.Object{}, false
	}
	return there[random.IntN(len(there))], true
}

// newValue returns a value that no put had.
func (k *knowledge) newValue() int64 {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	k.values++
	return k.values
}

// newRequestNumber returns a number that no request id had.
func (k *knowledge) newRequestNumber() int64 {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	k.ids++
	return k.ids
}

// addRequest remembers a request that has an id, before it is sent.
func (k *knowledge) addRequest(request *history.Request) {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	k.requests = append(k.requests, request)
	if len(k.requests) > rememberedRequests {
		k.requests = k.requests[1:]
	}
}

// recentRequest returns a random one of the newest requests, which may be under way, or nil.
func (k *knowledge) recentRequest(random *rand.Rand) *history.Request {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	if len(k.requests) == 0 {
		return nil
	}
	return k.requests[random.IntN(len(k.requests))]
}

// learn takes up an answer.
func (k *knowledge) learn(request *history.Request, answer *history.Answer) {
	k.mutex.Lock()
	defer k.mutex.Unlock()
	if answer.Status == history.NotFound {
		for _, edit := range request.Edits {
			delete(k.objects, edit.ID)
		}
	}
	if answer.Status != history.OK || request.AtRevision != nil || len(answer.ObjectIDs) != len(request.Edits) {
		return
	}
	k.newest = max(k.newest, answer.Revision)
	for i, edit := range request.Edits {
		if edit.Action == history.Delete {
			delete(k.objects, edit.ID)
			continue
		}
		k.see(history.Object{ID: answer.ObjectIDs[i], Place: edit.Place, Version: answer.Revision, Value: edit.Value})
	}
	for _, object := range answer.Objects {
		k.see(object)
	}
}

func (k *knowledge) see(object history.Object) {
	if k.objects[object.ID].Version < object.Version {
		k.objects[object.ID] = object
	}
}
