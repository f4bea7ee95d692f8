package model

import (
	"cmp"
	"hash/maphash"
	"slices"

	"hypermap-linearizability/history"
)

// state is the map at one revision. A state is never changed: an edit makes a new one, which refers to
// the one before. So a state has the whole past of the map, which queries of the past and retries of
// requests need, and the states that the checker tries share it.
type state struct {
	before   *state // nil for the first
	revision int64
	objects  []history.Object // sorted by id
	nextID   int64
	// The request that made the revision, and the ids of the objects that it put; nil for the first.
	made *history.Request
	ids  []int64
	// The number of reads of this revision that have been linearized, see cuts.
	reads int
	hash  uint64
}

var hashSeed = maphash.MakeSeed()

func newState(initial history.Map) *state {
	objects := slices.Clone(initial.Objects)
	slices.SortFunc(objects, func(a, b history.Object) int { return cmp.Compare(a.ID, b.ID) })
	return &state{revision: initial.Revision, objects: objects, nextID: initial.NextID}
}

// withRead returns the same state, with one more read linearized.
func (s *state) withRead() *state {
	next := *s
	next.reads++
	return &next
}

// next returns the state after the edits of a request, with the status that the request gets. The
// state is s itself unless the status is OK, because a batch is carried out as a whole or not at all.
func (s *state) next(request *history.Request) (*state, history.Status) {
	if request.IfLayer != nil && *request.IfLayer != s.revision {
		// There is one layer, and every commit changes it, so that its version is the newest revision.
		return s, history.Aborted
	}
	b := batch{revision: s.revision + 1, nextID: s.nextID, objects: slices.Clone(s.objects)}
	ids := make([]int64, len(request.Edits))
	for i, edit := range request.Edits {
		id, status := b.apply(edit)
		if status != history.OK {
			return s, status
		}
		ids[i] = id
	}
	return &state{
		before:   s,
		revision: b.revision,
		objects:  b.objects,
		nextID:   b.nextID,
		made:     request,
		ids:      ids,
		hash:     nextHash(s.hash, request),
	}, history.OK
}

// nextHash returns the hash of the state that a request makes. The state follows from the requests
// that were carried out, so they stand for it.
func nextHash(before uint64, request *history.Request) uint64 {
	mixed := before*0x9E3779B97F4A7C15 + maphash.String(hashSeed, request.ID)
	for _, edit := range request.Edits {
		mixed = mixed*0x9E3779B97F4A7C15 + uint64(edit.Value)
	}
	return mixed
}

// at returns the state of a past revision, or nil if there is none.
func (s *state) at(revision int64) *state {
	for ; s != nil; s = s.before {
		if s.revision == revision {
			return s
		}
	}
	return nil
}

// receipt returns the state that the request with this id has made, or nil.
func (s *state) receipt(id string) *state {
	if id == "" {
		return nil
	}
	for ; s != nil; s = s.before {
		if s.made != nil && s.made.ID == id {
			return s
		}
	}
	return nil
}

// equals reports whether two states came about by the same requests in the same order.
func (s *state) equals(other *state) bool {
	if s.hash != other.hash || s.revision != other.revision || s.reads != other.reads {
		return false
	}
	for s.before != other.before {
		if s.before == nil || other.before == nil || s.before.hash != other.before.hash || !s.made.SameAs(other.made) {
			return false
		}
		s, other = s.before, other.before
	}
	return s.made == other.made || s.made.SameAs(other.made)
}

// batch applies the edits of one request one after another. Each sees what the ones before it did.
type batch struct {
	revision int64
	nextID   int64
	objects  []history.Object
}

// apply carries out an edit, and returns the id of the object that it put, or 0.
func (b *batch) apply(edit history.Edit) (int64, history.Status) {
	put := history.Object{ID: edit.ID, Place: edit.Place, Version: b.revision, Value: edit.Value}
	if edit.Action == history.Create {
		put.ID = b.nextID
		b.nextID++
		b.objects = append(b.objects, put) // The newest id is the greatest.
		return put.ID, history.OK
	}
	i := slices.IndexFunc(b.objects, func(o history.Object) bool { return o.ID == edit.ID })
	// The condition is checked first: an object that is missing has another version than any.
	if edit.IfVersion != nil && (i < 0 || b.objects[i].Version != *edit.IfVersion) {
		return 0, history.Aborted
	}
	if i < 0 {
		return 0, history.NotFound
	}
	if edit.Action == history.Delete {
		b.objects = slices.Delete(b.objects, i, i+1)
		return 0, history.OK
	}
	b.objects[i] = put
	return put.ID, history.OK
}
