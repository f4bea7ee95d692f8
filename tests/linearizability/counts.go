package main

import (
	"encoding/json"
	"slices"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/model"
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
	// Of several servers: the faults of the map's owner after which the map was written again, and the
	// times that it could not be written.
	Failovers       int     `json:"failovers,omitempty"`
	WriteGapP50     float64 `json:"write_gap_p50_s,omitempty"`
	WriteGapP99     float64 `json:"write_gap_p99_s,omitempty"`
	writeGaps       []time.Duration
	UnknownOutcomes int `json:"unknown_outcomes"`
	Violations      int `json:"violations"`
	Undecided       int `json:"undecided"`
	// Why the proof could not be carried out.
	Error string `json:"error,omitempty"`
	Holds bool   `json:"holds"`
}

func (c *counts) add(h *history.History, verdict model.Verdict) {
	c.Histories++
	c.Kills += h.Kills
	c.addWriteGaps(h.WriteGaps)
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

func (c *counts) addWriteGaps(gaps []time.Duration) {
	c.writeGaps = append(c.writeGaps, gaps...)
	slices.Sort(c.writeGaps)
	c.Failovers = len(c.writeGaps)
	if c.Failovers > 0 {
		c.WriteGapP50 = c.writeGaps[(c.Failovers-1)/2].Seconds()
		c.WriteGapP99 = c.writeGaps[(c.Failovers*99+99)/100-1].Seconds()
	}
}

// judge sets Holds, and returns it. Something must have been judged, and nothing left undecided, and a
// map must not have been without writes for longer than `maxWriteGap` in the 99th percentile.
func (c *counts) judge(maxWriteGap time.Duration) bool {
	c.Holds = c.Error == "" && c.Histories > 0 && c.Violations == 0 && c.Undecided == 0 &&
		c.WriteGapP99 <= maxWriteGap.Seconds()
	return c.Holds
}

func (c *counts) line() string {
	text, err := json.Marshal(c)
	if err != nil {
		return err.Error()
	}
	return string(text)
}
