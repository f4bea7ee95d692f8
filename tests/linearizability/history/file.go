package history

import (
	"bufio"
	"encoding/json"
	"errors"
	"fmt"
	"io"
	"os"
	"time"
)

// header is the first line of a file. Each further line is an operation.
type header struct {
	Seed        uint64                     `json:"seed"`
	Number      int                        `json:"history"`
	Initial     Map                        `json:"initial"`
	Kills       int                        `json:"kills"`
	Events      []Event                    `json:"events,omitempty"`
	WriteGaps   map[string][]time.Duration `json:"write_gaps_ns,omitempty"`
	Told        map[int64][]Change         `json:"told,omitempty"`
	WatchFaults WatchFaults                `json:"watch_faults"`
}

// Write writes the history as JSON lines.
func (h *History) Write(to io.Writer) error {
	buffered := bufio.NewWriter(to)
	lines := json.NewEncoder(buffered)
	if err := lines.Encode(header{h.Seed, h.Number, h.Initial, h.Kills, h.Events, h.WriteGaps, h.Told, h.WatchFaults}); err != nil {
		return err
	}
	for i := range h.Operations {
		if err := lines.Encode(&h.Operations[i]); err != nil {
			return err
		}
	}
	return buffered.Flush()
}

// WriteFile writes the history to a new file.
func (h *History) WriteFile(path string) error {
	file, err := os.Create(path)
	if err != nil {
		return err
	}
	return errors.Join(h.Write(file), file.Close())
}

// Read reads a history that Write has written.
func Read(from io.Reader) (*History, error) {
	lines := json.NewDecoder(bufio.NewReader(from))
	var first header
	if err := lines.Decode(&first); err != nil {
		return nil, fmt.Errorf("the header: %w", err)
	}
	h := &History{
		Seed: first.Seed, Number: first.Number, Initial: first.Initial, Kills: first.Kills, Events: first.Events,
		WriteGaps: first.WriteGaps, Told: first.Told, WatchFaults: first.WatchFaults,
	}
	for {
		var operation Operation
		switch err := lines.Decode(&operation); {
		case errors.Is(err, io.EOF):
			return h, nil
		case err != nil:
			return nil, fmt.Errorf("operation %d: %w", len(h.Operations)+1, err)
		}
		h.Operations = append(h.Operations, operation)
	}
}

// ReadFile reads a history from a file.
func ReadFile(path string) (*History, error) {
	file, err := os.Open(path)
	if err != nil {
		return nil, err
	}
	defer file.Close()
	h, err := Read(file)
	if err != nil {
		return nil, fmt.Errorf("%s: %w", path, err)
	}
	return h, nil
}
