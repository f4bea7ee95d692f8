// Package model is the sequential specification of a map, for Porcupine: what each operation must
// answer if no other is under way, by docs/protocol.md.
//
//   - A batch of edits makes the next revision, and is carried out as a whole or not at all. Its
//     conditions hold in the state that it is applied to; otherwise it is ABORTED or NOT_FOUND.
//   - A request whose id is known gets its first answer again and changes nothing. Another request
//     with that id is INVALID_ARGUMENT.
//   - A read tells the whole state of the one revision that it names: the newest, or a past one.
//   - The map stays the same incarnation.
//
// An edit of unknown outcome may take effect at any time after its call. One that never does is the
// same as one that does so after everything else, so it ends with the history.
//
// A history can't be partitioned by object, since revisions and batches concern the whole map. It is
// cheap to judge nevertheless, because the revisions in the answers give the edits their order.
package model

import (
	"slices"
	"time"

	"github.com/anishathalye/porcupine"

	"hypermap-linearizability/history"
)

// Verdict is the result of judging a history.
type Verdict int

// The verdicts. Undecided means that the time did not suffice.
const (
	Undecided Verdict = iota
	Linearizable
	Violation
)

// Judge reports whether the history is linearizable.
func Judge(h *history.History, timeout time.Duration) Verdict {
	return verdictOf(porcupine.CheckOperationsTimeout(newModel(h, newCuts(h.Operations)), operationsOf(h), timeout))
}

// Visualize judges the history once more and writes an HTML page, which shows the operations, the longest orders
// that are legal, and the operations that fit into none of them.
func Visualize(h *history.History, timeout time.Duration, path string) error {
	model := newModel(h, newCuts(h.Operations))
	_, info := porcupine.CheckOperationsVerbose(model, operationsOf(h), timeout)
	info.AddAnnotations(annotationsOf(h))
	return porcupine.VisualizePath(model, info, path)
}

func verdictOf(result porcupine.CheckResult) Verdict {
	switch result {
	case porcupine.Ok:
		return Linearizable
	case porcupine.Illegal:
		return Violation
	}
	return Undecided
}

// operationsOf returns the operations as Porcupine takes them: inputs are *history.Request, outputs
// *history.Answer, which is nil if the outcome is unknown.
func operationsOf(h *history.History) []porcupine.Operation {
	end := time.Duration(0)
	for i := range h.Operations {
		end = max(end, h.Operations[i].Call, h.Operations[i].Return)
	}
	operations := make([]porcupine.Operation, len(h.Operations))
	for i := range h.Operations {
		operation := &h.Operations[i]
		returned := operation.Return
		if operation.Answer == nil {
			returned = end + 1
		}
		operations[i] = porcupine.Operation{
			ClientId: operation.Client,
			Input:    &operation.Request,
			Call:     int64(operation.Call),
			Output:   operation.Answer,
			Return:   int64(returned),
			Metadata: operation,
		}
	}
	return operations
}

func newModel(h *history.History, c *cuts) porcupine.Model {
	spec := specification{incarnation: h.Initial.Incarnation, cuts: c}
	return porcupine.Model{
		Init: func() any { return newState(h.Initial) },
		Step: func(before, input, output any) (bool, any) {
			return spec.step(before.(*state), input.(*history.Request), output.(*history.Answer))
		},
		Equal:                     func(a, b any) bool { return a.(*state).equals(b.(*state)) },
		Hash:                      func(s any) uint64 { return s.(*state).hash },
		DescribeOperation:         describeOperation,
		DescribeState:             describeState,
		DescribeOperationMetadata: describeMetadata,
	}
}

// specification decides which answers are legal in a state.
type specification struct {
	incarnation uint64
	cuts        *cuts
}

// step reports whether the request may get this answer in the state, and returns the state after it.
func (m specification) step(s *state, request *history.Request, answer *history.Answer) (bool, *state) {
	switch {
	case answer != nil && answer.Status == history.OK && answer.Incarnation != m.incarnation:
		return false, s
	case request.IsRead():
		return m.stepRead(s, request, answer)
	case answer == nil:
		return m.stepUnknown(s, request)
	}
	return m.stepEdit(s, request, answer)
}

func (m specification) stepEdit(s *state, request *history.Request, answer *history.Answer) (bool, *state) {
	if made := s.receipt(request.ID); made != nil {
		if !made.made.SameAs(request) {
			return answer.Status == history.InvalidArgument, s
		}
		return isReceiptOf(made, answer), s
	}
	next, status := s.next(request)
	if status != history.OK {
		return answer.Status == status, s
	}
	return isReceiptOf(next, answer) && m.cuts.mayLeave(s), next
}

// isReceiptOf reports whether the answer is that of the edit that made the state.
func isReceiptOf(made *state, answer *history.Answer) bool {
	return answer.Status == history.OK && answer.Revision == made.revision && slices.Equal(answer.ObjectIDs, made.ids)
}

func (m specification) stepUnknown(s *state, request *history.Request) (bool, *state) {
	if s.receipt(request.ID) != nil {
		return true, s
	}
	next, _ := s.next(request)
	if next == s {
		return true, s
	}
	return m.cuts.mayLeave(s) && m.cuts.mayMake(next.revision, request), next
}

func (m specification) stepRead(s *state, request *history.Request, answer *history.Answer) (bool, *state) {
	switch {
	case answer == nil:
		return true, s
	case request.AtRevision != nil:
		return isAnswerOfThePast(s, request, answer), s
	case answer.Status != history.OK || answer.Revision < request.MinRevision || !isSeenAt(s, request, answer):
		return false, s
	}
	return true, s.withRead()
}

func isAnswerOfThePast(s *state, request *history.Request, answer *history.Answer) bool {
	if *request.AtRevision > s.revision {
		return answer.Status == history.OutOfRange
	}
	past := s.at(*request.AtRevision)
	return past != nil && answer.Status == history.OK && isSeenAt(past, request, answer)
}

// isSeenAt reports whether the answer names the state's revision and has what the state has.
func isSeenAt(s *state, request *history.Request, answer *history.Answer) bool {
	if answer.Revision != s.revision {
		return false
	}
	switch request.RPC {
	case history.GetMap:
		return true
	case history.QueryPoint:
		there := slices.DeleteFunc(slices.Clone(s.objects), func(o history.Object) bool { return o.Place != request.Place })
		return slices.Equal(there, answer.Objects)
	}
	return slices.Equal(s.objects, answer.Objects)
}
