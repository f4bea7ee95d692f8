package recorder

import (
	"fmt"
	"math/rand/v2"
	"slices"

	"hypermap-linearizability/history"
)

// workload chooses the requests of one client. Few places, and conditions on versions that other
// clients are about to change, make the clients contend.
type workload struct {
	random *rand.Rand
	places int
	known  *knowledge
	// linearizable makes all reads linearizable questions: there are several servers.
	linearizable bool
}

// The shares of the requests. The rest are edits of a single object.
const (
	readShare       = 0.40
	batchShare      = 0.15
	layerShare      = 0.05
	repeatShare     = 0.06
	reusedIDShare   = 0.02
	withoutIDShare  = 0.08
	pastShare       = 0.15 // of queries
	waitingShare    = 0.20 // of queries
	staleShare      = 0.10 // of conditional edits
	conditionShare  = 0.50 // of edits of an object that are alone
	inBatchShare    = 0.15 // of edits of an object in a batch that have a condition
	deleteShare     = 0.20 // of edits of an object
	createShare     = 0.10 // of edits at a place where there is an object
	maxBatchedEdits = 4
)

func (w *workload) chance(share float64) bool { return w.random.Float64() < share }

// next returns the client's next request.
func (w *workload) next() *history.Request {
	if w.chance(readShare) {
		return w.read()
	}
	return w.edits()
}

func (w *workload) read() *history.Request {
	request := &history.Request{Linearizable: w.linearizable}
	switch pick := w.random.Float64(); {
	case pick < 0.15 && !w.linearizable: // GetMap is no question.
		request.RPC = history.GetMap
		return request
	case pick < 0.60:
		request.RPC, request.Place = history.QueryPoint, w.random.IntN(w.places)
	case pick < 0.80:
		request.RPC = history.QueryArea
	case pick < 0.90:
		request.RPC = history.QueryValue
	default:
		request.RPC = history.QueryNearest
	}
	newest := w.known.newestRevision()
	if w.chance(pastShare) {
		// Some of these revisions do not exist yet.
		past := max(1, newest+3-w.random.Int64N(20))
		request.AtRevision = &past
	} else if w.chance(waitingShare) {
		request.MinRevision = newest
	}
	return request
}

func (w *workload) edits() *history.Request {
	switch pick := w.random.Float64(); {
	case pick < repeatShare:
		if request := w.known.recentRequest(w.random); request != nil {
			return request
		}
	case pick < repeatShare+reusedIDShare:
		if request := w.known.recentRequest(w.random); request != nil {
			return &history.Request{RPC: history.ApplyEdits, ID: request.ID, Edits: w.batch(1)}
		}
	case pick < repeatShare+reusedIDShare+batchShare:
		return w.identified(&history.Request{Edits: w.batch(2 + w.random.IntN(maxBatchedEdits-1))})
	case pick < repeatShare+reusedIDShare+batchShare+layerShare:
		newest := w.known.newestRevision()
		return w.identified(&history.Request{Edits: w.batch(1), IfLayer: &newest})
	}
	return w.identified(&history.Request{Edits: w.batch(1)})
}

// identified gives a request an id of its own, or leaves it without one.
func (w *workload) identified(request *history.Request) *history.Request {
	request.RPC = history.ApplyEdits
	if !w.chance(withoutIDShare) {
		request.ID = fmt.Sprint("e", w.known.newRequestNumber())
		w.known.addRequest(request)
	}
	return request
}

func (w *workload) batch(size int) []history.Edit {
	conditions := conditionShare
	if size > 1 {
		// One condition that fails is enough to refuse a batch.
		conditions = inBatchShare
	}
	edits := make([]history.Edit, size)
	for i := range edits {
		edits[i] = w.edit(edits[:i], conditions)
	}
	return edits
}

// edit returns an edit at a random place, for a batch with some edits before it. It has a condition with
// the given probability, if there is an object to which it can apply.
func (w *workload) edit(before []history.Edit, conditions float64) history.Edit {
	place := w.random.IntN(w.places)
	there, ok := w.known.objectAt(place, w.random)
	deleted := slices.ContainsFunc(before, func(e history.Edit) bool { return e.Action == history.Delete && e.ID == there.ID })
	if !ok || deleted || w.chance(createShare) {
		return history.Edit{Action: history.Create, Place: place, Value: w.known.newValue()}
	}
	edit := history.Edit{ID: there.ID}
	if w.chance(deleteShare) {
		edit.Action = history.Delete
	} else {
		edit.Action, edit.Place, edit.Value = history.Put, place, w.known.newValue()
	}
	if w.chance(conditions) {
		version := there.Version
		if w.chance(staleShare) {
			version--
		}
		edit.IfVersion = &version
	}
	return edit
}
