package model

import "hypermap-linearizability/history"

// cuts tells the checker early that a partial order of the operations can't be completed. Answers name
// revisions, and two conditions on these are necessary for every linearization:
//
//   - A read that was answered with revision r comes before the edit that makes r+1, because it is
//     legal in no other state. So an edit may leave r only when all reads of r have been linearized.
//   - The edit that was answered with revision r made it, or is a retry of the same request. So an edit
//     of unknown outcome, which would be legal anywhere, may make r only if it is that request.
//
// They reject no history that is linearizable. Without them, the checker would find out only at the
// end of the read, or at the end of the edit, and try everything that is concurrent in all orders until
// then: 2^n sets of n reads, and n! orders of n edits of unknown outcome.
//
// A nil *cuts cuts nothing.
type cuts struct {
	// The number of reads of the newest revision that were answered with this one.
	reads map[int64]int
	// The request that was answered with this revision. If several were, an arbitrary one of them: the
	// history is then linearizable only if they are the same.
	makers map[int64]*history.Request
}

func newCuts(operations []history.Operation) *cuts {
	c := &cuts{reads: map[int64]int{}, makers: map[int64]*history.Request{}}
	for i := range operations {
		operation := &operations[i]
		switch {
		case operation.Answer == nil || operation.Answer.Status != history.OK:
		case !operation.Request.IsRead():
			c.makers[operation.Answer.Revision] = &operation.Request
		case operation.Request.AtRevision == nil:
			c.reads[operation.Answer.Revision]++
		}
	}
	return c
}

// mayLeave reports whether all reads of the state's revision have been linearized.
func (c *cuts) mayLeave(s *state) bool { return c == nil || s.reads >= c.reads[s.revision] }

// mayMake reports whether an edit of unknown outcome may make the revision.
func (c *cuts) mayMake(revision int64, request *history.Request) bool {
	if c == nil {
		return true
	}
	maker := c.makers[revision]
	return maker == nil || maker.SameAs(request)
}
