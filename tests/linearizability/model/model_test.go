package model

import (
	"slices"
	"testing"

	"hypermap-linearizability/history"
)

func TestOneOperationAfterAnother(t *testing.T) {
	expect(t, Linearizable, sequel(
		saw(all(), 1, thing(1, 1, 0), thing(2, 1, 0)),
		made(2, edits("a", put(1, 10))),
		saw(all(), 2, thing(1, 2, 10), thing(2, 1, 0)),
		madeWithIDs(3, edits("b", create(1, 11), remove(2)), 3, 0),
		saw(atPlace(1), 3, thing(1, 2, 10), history.Object{ID: 3, Place: 1, Version: 3, Value: 11}),
		saw(atPlace(2), 3),
		saw(newest(), 3),
	))
}

func TestAReadDuringAnEditSeesTheMapBeforeOrAfterIt(t *testing.T) {
	edit := span(0, 100, made(2, edits("a", put(1, 10))))
	before, after := saw(atPlace(1), 1, thing(1, 1, 0)), saw(atPlace(1), 2, thing(1, 2, 10))
	expect(t, Linearizable, []history.Operation{edit, span(10, 20, before), span(30, 40, after)})
	expect(t, Violation, []history.Operation{edit, span(10, 20, after), span(30, 40, before)})
}

func TestAStaleRead(t *testing.T) {
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), saw(atPlace(1), 1, thing(1, 1, 0))))
	// Of another object, whose content is the same.
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), saw(atPlace(2), 1, thing(2, 1, 0))))
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), saw(newest(), 1)))
}

func TestAReadThatClaimsANewerRevisionThanItsContent(t *testing.T) {
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), saw(atPlace(1), 2, thing(1, 1, 0))))
}

func TestALostUpdate(t *testing.T) {
	expect(t, Violation, sequel(
		made(2, edits("a", put(1, 10))), made(2, edits("b", put(2, 20))),
		saw(all(), 2, thing(1, 1, 0), thing(2, 2, 20))))
	// The edit was lost when the server was killed, and others saw it before.
	expect(t, Violation, sequel(
		made(2, edits("a", put(1, 10))), saw(atPlace(1), 2, thing(1, 2, 10)), saw(atPlace(1), 1, thing(1, 1, 0))))
}

func TestAnEditThatIsAppliedTwice(t *testing.T) {
	expect(t, Violation, sequel(made(3, edits("a", put(1, 10))), saw(atPlace(1), 3, thing(1, 3, 10))))
	expect(t, Violation, sequel(
		madeWithIDs(2, edits("a", create(1, 10)), 3),
		saw(atPlace(1), 3, thing(1, 1, 0),
			history.Object{ID: 3, Place: 1, Version: 2, Value: 10},
			history.Object{ID: 4, Place: 1, Version: 3, Value: 10})))
}

func TestASkippedRevision(t *testing.T) {
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), made(4, edits("b", put(1, 11)))))
}

func TestARevisionThatIsGivenTwice(t *testing.T) {
	expect(t, Violation, sequel(made(2, edits("a", put(1, 10))), made(2, edits("b", put(1, 11)))))
}

func TestHalfABatch(t *testing.T) {
	batch := edits("a", put(1, 10), put(2, 20))
	expect(t, Violation, sequel(made(2, batch), saw(all(), 2, thing(1, 2, 10), thing(2, 1, 0))))
	// A reader saw half of it while it was under way.
	expect(t, Violation, []history.Operation{
		span(0, 100, made(2, batch)),
		span(10, 20, saw(all(), 1, thing(1, 2, 10), thing(2, 1, 0))),
	})
	// Half of it survived a kill.
	expect(t, Violation, []history.Operation{
		span(0, 0, unknown(batch)),
		span(10, 20, saw(all(), 2, thing(1, 2, 10), thing(2, 1, 0))),
	})
	expect(t, Linearizable, sequel(
		refused(history.Aborted, edits("a", put(1, 10), putIf(2, 20, 9))),
		saw(all(), 1, thing(1, 1, 0), thing(2, 1, 0))))
	expect(t, Violation, sequel(
		refused(history.Aborted, edits("a", put(1, 10), putIf(2, 20, 9))),
		saw(all(), 1, thing(1, 2, 10), thing(2, 1, 0))))
}

func TestEditsOfABatchSeeThoseBeforeThem(t *testing.T) {
	expect(t, Linearizable, sequel(
		made(2, edits("a", put(1, 10), putIf(1, 11, 2))), saw(atPlace(1), 2, thing(1, 2, 11))))
	expect(t, Linearizable, sequel(refused(history.NotFound, edits("a", remove(1), put(1, 11)))))
	expect(t, Violation, sequel(made(2, edits("a", remove(1), put(1, 11)))))
}

func TestConditions(t *testing.T) {
	first := made(2, edits("a", put(1, 10)))
	expect(t, Linearizable, sequel(first, made(3, edits("b", putIf(1, 11, 2)))))
	expect(t, Linearizable, sequel(first, refused(history.Aborted, edits("b", putIf(1, 11, 1)))))
	expect(t, Violation, sequel(first, made(3, edits("b", putIf(1, 11, 1)))))
	expect(t, Violation, sequel(first, refused(history.Aborted, edits("b", putIf(1, 11, 2)))))
	expect(t, Linearizable, sequel(refused(history.NotFound, edits("b", put(9, 11)))))
	expect(t, Linearizable, sequel(refused(history.Aborted, edits("b", putIf(9, 11, 1)))))
	expect(t, Violation, sequel(refused(history.NotFound, edits("b", put(1, 11)))))

	onLayer := func(version int64) history.Request {
		request := edits("b", put(2, 20))
		request.IfLayer = ref(version)
		return request
	}
	expect(t, Linearizable, sequel(first, made(3, onLayer(2))))
	expect(t, Linearizable, sequel(first, refused(history.Aborted, onLayer(1))))
	expect(t, Violation, sequel(first, made(3, onLayer(1))))
}

func TestOfTwoConditionalEditsAtOnceOneSucceeds(t *testing.T) {
	a, b := edits("a", putIf(1, 10, 1)), edits("b", putIf(1, 11, 1))
	expect(t, Linearizable, []history.Operation{span(0, 10, refused(history.Aborted, a)), span(1, 9, made(2, b))})
	expect(t, Violation, []history.Operation{span(0, 10, made(2, a)), span(1, 9, made(3, b))})
	expect(t, Violation, []history.Operation{span(0, 10, refused(history.Aborted, a)), span(1, 9, refused(history.Aborted, b))})
}

func TestAnUnknownOutcome(t *testing.T) {
	edit := span(10, 0, unknown(edits("a", put(1, 10))))
	before, after := saw(atPlace(1), 1, thing(1, 1, 0)), saw(atPlace(1), 2, thing(1, 2, 10))
	expect(t, Linearizable, []history.Operation{edit})
	expect(t, Linearizable, []history.Operation{edit, span(20, 30, before), span(40, 50, before)})
	expect(t, Linearizable, []history.Operation{edit, span(20, 30, before), span(40, 50, after)})
	expect(t, Violation, []history.Operation{edit, span(20, 30, after), span(40, 50, before)})
	expect(t, Violation, []history.Operation{span(0, 5, after), edit})
	// It takes effect once.
	expect(t, Violation, []history.Operation{edit, span(20, 30, saw(atPlace(1), 3, thing(1, 3, 10)))})
}

func TestUnknownOutcomesExplainTheRevisionsThatNobodyWasAnswered(t *testing.T) {
	operations := []history.Operation{
		span(0, 0, unknown(edits("a", put(1, 10)))),
		span(1, 0, unknown(edits("b", put(1, 11)))),
		span(2, 0, unknown(edits("c", putIf(1, 12, 1)))), // Either first, or refused.
		span(10, 20, made(4, edits("d", put(2, 20)))),
	}
	expect(t, Linearizable, operations)
	sees := func(object history.Object) []history.Operation {
		return append(slices.Clone(operations), span(30, 40, saw(atPlace(1), 4, object)))
	}
	expect(t, Linearizable, sees(thing(1, 3, 10)))
	expect(t, Linearizable, sees(thing(1, 3, 11)))
	expect(t, Violation, sees(thing(1, 3, 12))) // The condition did not hold any more.
	expect(t, Violation, sees(thing(1, 2, 10))) // Then nothing made revision 3.
}

func TestARepeatedRequestGetsTheSameAnswerAndChangesNothing(t *testing.T) {
	request := edits("a", put(1, 10))
	expect(t, Linearizable, sequel(made(2, request), made(3, edits("b", put(1, 11))), made(2, request),
		saw(atPlace(1), 3, thing(1, 3, 11))))
	expect(t, Violation, sequel(made(2, request), made(3, request)))
	expect(t, Violation, sequel(made(2, request), made(3, edits("b", put(1, 11))), made(2, request),
		saw(atPlace(1), 4, thing(1, 4, 10))))
	// After an unknown outcome, the retry tells it.
	expect(t, Linearizable, []history.Operation{
		span(0, 0, unknown(request)), span(10, 20, made(3, edits("b", put(2, 20)))), span(30, 40, made(2, request))})
	// A request without an id is carried out again.
	expect(t, Linearizable, sequel(made(2, edits("", put(1, 10))), made(3, edits("", put(1, 10)))))
}

func TestARefusedRequestHasNoReceipt(t *testing.T) {
	request := edits("a", putIf(1, 10, 2))
	expect(t, Linearizable, sequel(
		refused(history.Aborted, request), made(2, edits("b", put(1, 11))), made(3, request)))
}

func TestAnotherRequestWithAUsedID(t *testing.T) {
	first, other := edits("a", put(1, 10)), edits("a", put(1, 11))
	expect(t, Linearizable, sequel(made(2, first), refused(history.InvalidArgument, other)))
	expect(t, Violation, sequel(made(2, first), made(2, other)))
	expect(t, Violation, sequel(made(2, first), made(3, other)))
	expect(t, Violation, sequel(refused(history.InvalidArgument, other)))
	// Either of two at once may come first.
	expect(t, Linearizable, []history.Operation{
		span(0, 10, refused(history.InvalidArgument, first)), span(1, 9, made(2, other))})
}

func TestThePastStaysAsItWas(t *testing.T) {
	one, two := made(2, edits("a", put(1, 10))), made(3, edits("b", put(1, 11)))
	expect(t, Linearizable, sequel(one, two,
		saw(past(2), 2, thing(1, 2, 10), thing(2, 1, 0)), saw(past(1), 1, thing(1, 1, 0), thing(2, 1, 0)),
		refused(history.OutOfRange, past(4))))
	expect(t, Violation, sequel(one, two, saw(past(2), 2, thing(1, 3, 11), thing(2, 1, 0))))
	expect(t, Violation, sequel(one, two, saw(past(2), 3, thing(1, 3, 11), thing(2, 1, 0))))
	expect(t, Violation, sequel(one, two, refused(history.OutOfRange, past(3))))
	expect(t, Violation, sequel(one, saw(past(3), 3, thing(1, 3, 11), thing(2, 1, 0)), two))
}

func TestAReadWaitsForItsRevision(t *testing.T) {
	waiting := newest()
	waiting.RPC, waiting.MinRevision = history.QueryPoint, 2
	edit := span(20, 30, made(2, edits("a", remove(1), remove(2))))
	expect(t, Linearizable, []history.Operation{span(0, 40, saw(waiting, 2)), edit})
	expect(t, Violation, []history.Operation{span(0, 40, saw(waiting, 1)), edit})
}

func TestTheMapStaysTheSameIncarnation(t *testing.T) {
	other := saw(newest(), 1)
	other.answer.Incarnation++
	expect(t, Violation, sequel(other))
}

func TestAnIDIsGivenOnce(t *testing.T) {
	expect(t, Linearizable, sequel(madeWithIDs(2, edits("a", create(1, 10)), 3), made(3, edits("b", remove(3))),
		madeWithIDs(4, edits("c", create(1, 11)), 4)))
	expect(t, Violation, sequel(madeWithIDs(2, edits("a", create(1, 10)), 3), made(3, edits("b", remove(3))),
		madeWithIDs(4, edits("c", create(1, 11)), 3)))
}
