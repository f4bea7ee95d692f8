package model

import (
	"math"
	"slices"

	"hypermap-linearizability/history"
)

// Audit counts violations that can be seen without a search, by their sort. A history with any of them is
// not linearizable, or its watches are wrong; one with none may be not linearizable all the same.
type Audit struct {
	// EditsLost are acknowledged edits that the watches were not told of with the revision that was
	// acknowledged. EditsTwice are edits that two revisions have.
	EditsLost  int
	EditsTwice int
	// StaleReads are answers older than what had been answered before they were asked for.
	StaleReads int
}

// Examine audits a history. Without watches, EditsLost and EditsTwice are not known, and 0.
func Examine(h *history.History) Audit {
	audit := Audit{StaleReads: countStale(h.Operations)}
	if len(h.Told) == 0 {
		return audit
	}
	revisions := revisionsOfValues(h.Told)
	for _, made := range revisions {
		if len(made) > 1 {
			audit.EditsTwice++
		}
	}
	for i := range h.Operations {
		audit.EditsLost += countLost(&h.Operations[i], revisions)
	}
	return audit
}

// revisionsOfValues returns the revisions that put each value, which no two edits have in common.
func revisionsOfValues(told map[int64][]history.Change) map[int64][]int64 {
	revisions := map[int64][]int64{}
	for revision, changes := range told {
		for _, change := range changes {
			if change.Value != 0 && !slices.Contains(revisions[change.Value], revision) {
				revisions[change.Value] = append(revisions[change.Value], revision)
			}
		}
	}
	return revisions
}

// countLost counts the puts of an acknowledged request that its revision does not have.
func countLost(operation *history.Operation, revisions map[int64][]int64) int {
	lost := 0
	edits := operation.Request.Edits
	if operation.Answer == nil || operation.Answer.Status != history.OK {
		return 0
	}
	for i, edit := range edits {
		isReplaced := edit.Action == history.Put &&
			slices.ContainsFunc(edits[i+1:], func(later history.Edit) bool { return later.ID == edit.ID })
		if edit.Action == history.Delete || isReplaced {
			continue
		}
		if !slices.Contains(revisions[edit.Value], operation.Answer.Revision) {
			lost++
		}
	}
	return lost
}

// countStale counts the reads of the newest state whose answers are older than an answer that had come
// before their calls.
func countStale(operations []history.Operation) int {
	var answered []history.Operation
	for _, o := range operations {
		if o.Answer != nil && o.Answer.Status == history.OK {
			answered = append(answered, o)
		}
	}
	byReturn := slices.Clone(answered)
	slices.SortFunc(byReturn, func(a, b history.Operation) int { return int(a.Return - b.Return) })
	slices.SortFunc(answered, func(a, b history.Operation) int { return int(a.Call - b.Call) })
	stale, next, newest := 0, 0, int64(math.MinInt64)
	for _, o := range answered {
		for ; next < len(byReturn) && byReturn[next].Return < o.Call; next++ {
			newest = max(newest, byReturn[next].Answer.Revision)
		}
		if o.Request.IsRead() && o.Request.AtRevision == nil && o.Answer.Revision < newest {
			stale++
		}
	}
	return stale
}
