package main

import (
	"encoding/json"
	"slices"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/model"
	"hypermap-linearizability/recorder"
)

// counts are printed as the last line, in the form of the other proofs.
type counts struct {
	Proof      string `json:"proof"`
	Seed       uint64 `json:"seed"`
	Plant      string `json:"plant,omitempty"`
	Histories  int    `json:"histories"`
	Clients    int    `json:"clients,omitempty"`
	Operations int    `json:"operations"`
	Reads      int    `json:"reads"`
	// Edits that were acknowledged, and edits that were refused by a condition or because an object was
	// missing.
	EditsAcknowledged int `json:"edits_acknowledged"`
	EditsRefused      int `json:"edits_refused"`
	// Edits that were sent again after an attempt of unknown outcome, and those of them that had been
	// carried out, as far as others saw.
	EditsRetried       int `json:"edits_retried"`
	EditsMadeByEarlier int `json:"edits_made_by_earlier_attempts"`
	Kills              int `json:"kills"`
	// Of several servers: the faults after which the map was written again, and the times without writes, by
	// kind of fault; what watches were told wrongly.
	Failovers int                 `json:"failovers,omitempty"`
	WriteGaps map[string]writeGap `json:"time_without_writes,omitempty"`
	history.WatchFaults
	writeGaps       map[string][]time.Duration
	UnknownOutcomes int `json:"unknown_outcomes"`
	// What can be seen of violations without a search, see model.Audit.
	EditsLost  int `json:"acknowledged_edits_lost"`
	EditsTwice int `json:"edits_carried_out_twice"`
	StaleReads int `json:"stale_answers"`
	Violations int `json:"violations"`
	Undecided  int `json:"undecided"`
	// Why the proof could not be carried out.
	Error string `json:"error,omitempty"`
	Holds bool   `json:"holds"`
}

func (c *counts) add(h *history.History, verdict model.Verdict) {
	c.Histories++
	c.Kills += h.Kills
	c.addWriteGaps(h.WriteGaps)
	c.addAudit(h)
	c.Operations += len(h.Operations)
	for i := range h.Operations {
		c.addOperation(h, &h.Operations[i])
	}
	switch verdict {
	case model.Violation:
		c.Violations++
	case model.Undecided:
		c.Undecided++
	}
}

func (c *counts) addOperation(h *history.History, operation *history.Operation) {
	if operation.Request.IsRead() {
		c.Reads++
		return
	}
	if operation.Attempts > 1 {
		c.EditsRetried++
	}
	if h.WasCarriedOutBefore(operation) {
		c.EditsMadeByEarlier++
	}
	switch {
	case operation.Answer == nil:
		c.UnknownOutcomes++
	case operation.Answer.Status == history.OK:
		c.EditsAcknowledged++
	default:
		c.EditsRefused++
	}
}

// writeGap tells for how long a map was without writes after faults of one kind.
type writeGap struct {
	Faults int     `json:"faults"`
	P50    float64 `json:"p50_s"`
	P99    float64 `json:"p99_s"`
}

func (c *counts) addWriteGaps(added map[string][]time.Duration) {
	if c.writeGaps == nil {
		c.writeGaps, c.WriteGaps = map[string][]time.Duration{}, map[string]writeGap{}
	}
	for kind, more := range added {
		gaps := append(c.writeGaps[kind], more...)
		slices.Sort(gaps)
		c.writeGaps[kind] = gaps
		c.WriteGaps[kind] = writeGap{
			Faults: len(gaps),
			P50:    gaps[(len(gaps)-1)/2].Seconds(),
			P99:    gaps[(len(gaps)*99+99)/100-1].Seconds(),
		}
		c.Failovers += len(more)
	}
}

func (c *counts) addAudit(h *history.History) {
	audit := model.Examine(h)
	c.EditsLost += audit.EditsLost
	c.EditsTwice += audit.EditsTwice
	c.StaleReads += audit.StaleReads
	c.Gaps += h.WatchFaults.Gaps
	c.Repeats += h.WatchFaults.Repeats
	c.Reorders += h.WatchFaults.Reorders
	c.Others += h.WatchFaults.Others
}

// numWrong returns how much was found to be wrong.
func (c *counts) numWrong() int {
	return c.Violations + c.EditsLost + c.EditsTwice + c.StaleReads + c.Gaps + c.Repeats + c.Reorders + c.Others
}

// judge sets Holds, and returns it. Something must have been judged, and nothing left undecided, and a
// map whose owner was killed must not have been without writes for longer than `maxWriteGap` in the 99th
// percentile.
func (c *counts) judge(maxWriteGap time.Duration) bool {
	c.Holds = c.Error == "" && c.Histories > 0 && c.numWrong() == 0 && c.Undecided == 0 &&
		c.WriteGaps[string(recorder.Kill)].P99 <= maxWriteGap.Seconds()
	return c.Holds
}

func (c *counts) line() string {
	text, err := json.Marshal(c)
	if err != nil {
		return err.Error()
	}
	return string(text)
}
