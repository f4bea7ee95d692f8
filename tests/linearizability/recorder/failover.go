package recorder

import (
	"context"
	"errors"
	"fmt"
	"math"
	"math/rand/v2"
	"time"

	"hypermap-linearizability/history"
)

// lease is how long a server that has died or is frozen keeps its maps.
const lease = 3 * time.Second

// maxFrozenBeyondLease is how long a server is frozen at most after its lease is over.
const maxFrozenBeyondLease = 3 * time.Second

// maxCalm is the longest time between two faults.
const maxCalm = 2 * time.Second

// recordFleet makes a history with several servers.
func (r *run) recordFleet(ctx context.Context) (*history.History, error) {
	f, err := newFleet(r.options, r.fail)
	if err != nil {
		return nil, err
	}
	defer f.remove()
	r.dial = func(random *rand.Rand) (caller, func(), error) { return f.dial(r.schema, random) }
	r.awaitUp, r.manner = func(ctx context.Context) error { return ctx.Err() }, spread
	if err := f.start(); err != nil {
		return nil, err
	}
	initial, err := r.makeSharedMap(ctx, f)
	if err != nil {
		return nil, err
	}
	r.recording, r.known = newRecording(math.MaxInt), newKnowledge(initial)
	faults, err := r.newFaults(f)
	if err != nil {
		return nil, err
	}
	defer faults.writer.close()
	watchers := r.startWatchers(ctx, f, initial)
	number := 1 + faults.random.IntN(r.options.MaxKills)
	err = r.runClients(ctx, func() error {
		defer r.recording.stop()
		return faults.injectAll(ctx, number)
	})
	if err != nil {
		return nil, err
	}
	r.recording.addEvent("SIGKILL of all servers")
	f.kill()
	if err := f.start(); err != nil {
		return nil, err
	}
	if err := r.readAtTheEnd(ctx); err != nil {
		return nil, err
	}
	watchers.await(r.known.newestRevision())
	if err := context.Cause(ctx); err != nil {
		return nil, err
	}
	return &history.History{
		Seed: r.options.Seed, Number: r.options.Number, Initial: initial, Kills: number,
		Events: r.recording.events, WriteGaps: writeGaps(faults.times, r.recording.operations), Operations: r.recording.sorted(),
	}, nil
}

// makeSharedMap makes the map, and returns it when all servers have it.
func (r *run) makeSharedMap(ctx context.Context, f *fleet) (history.Map, error) {
	connections, err := f.connectAll(r.schema)
	if err != nil {
		return history.Map{}, err
	}
	defer closeAll(connections)
	made, err := makeMap(ctx, connections[0], r.options.Places)
	if err != nil {
		return history.Map{}, err
	}
	ctx, cancel := context.WithTimeout(ctx, startDeadline)
	defer cancel()
	for _, connection := range connections {
		for {
			answer, err := serverCaller{connection}.call(ctx, &history.Request{RPC: history.GetMap})
			if err == nil && answer.Status == history.OK && answer.Revision >= made.Revision {
				break
			}
			if err := pause(ctx, spread.pause); err != nil {
				return history.Map{}, fmt.Errorf("a server does not show the map: %w", err)
			}
		}
	}
	return made, nil
}

// faults are done to the server that owns the map.
type faults struct {
	fleet     *fleet
	recording *recording
	random    *rand.Rand
	// writer is the client that finds out when the map can be written again.
	writer *connectedClient
	// times are when the faults began.
	times []time.Duration
}

func (r *run) newFaults(f *fleet) (*faults, error) {
	writer, err := r.newClient(r.options.Clients + 2)
	if err != nil {
		return nil, err
	}
	writer.manner.giveUp = 0
	return &faults{fleet: f, recording: r.recording, random: r.random(0), writer: writer}, nil
}

// injectAll does this many faults, at any time between two renewals of the lease.
func (f *faults) injectAll(ctx context.Context, number int) error {
	for range number {
		if err := pause(ctx, randomTime(f.random, maxCalm)); err != nil {
			return nil // The run has ended, and tells why.
		}
		if err := f.inject(ctx); err != nil {
			return err
		}
	}
	return pause(ctx, randomTime(f.random, maxCalm))
}

// inject does one fault, and returns when the map was written and all servers run again.
func (f *faults) inject(ctx context.Context) error {
	owner, err := f.fleet.owner(ctx)
	if err != nil {
		return err
	}
	server, id := f.fleet.servers[owner], f.fleet.id(owner)
	kill := func() error { server.kill(); return nil }
	switch f.random.IntN(4) {
	case 0:
		return f.do(ctx, fault{what: "SIGKILL of " + id + ", which starts again at once", begin: kill, goOn: server.start})
	case 1:
		f.fleet.restarts++
		other := fmt.Sprintf("%s%d", id[:1], f.fleet.restarts)
		return f.do(ctx, fault{what: "SIGKILL of " + id + ", which starts again as " + other, begin: kill, goOn: func() error {
			f.fleet.name(owner, other)
			return server.start()
		}})
	case 2:
		return f.do(ctx, fault{what: "SIGKILL of " + id, begin: kill, mend: server.start})
	}
	frozen := lease + randomTime(f.random, maxFrozenBeyondLease)
	return f.do(ctx, fault{what: fmt.Sprintf("SIGSTOP of %s for %s", id, frozen), begin: server.freeze, goOn: func() error {
		if err := pause(ctx, frozen); err != nil {
			return err
		}
		f.recording.addEvent("SIGCONT of " + id)
		return server.thaw()
	}})
}

// fault is one fault of a server.
type fault struct {
	what  string
	begin func() error
	// goOn is what happens then, while the map may be written again. Nil: nothing.
	goOn func() error
	// mend is done when the map was written again. Nil: nothing.
	mend func() error
}

// do does a fault, and returns when the map was written again and the fault is mended.
func (f *faults) do(ctx context.Context, fault fault) error {
	nothing := func() error { return nil }
	if fault.goOn == nil {
		fault.goOn = nothing
	}
	if fault.mend == nil {
		fault.mend = nothing
	}
	f.recording.addEvent(fault.what)
	f.times = append(f.times, f.recording.now())
	if err := fault.begin(); err != nil {
		return err
	}
	ended := make(chan error, 1)
	go func() { ended <- fault.goOn() }()
	err := f.write(ctx)
	f.recording.addEvent("the map was written")
	if err = errors.Join(err, <-ended); err != nil {
		return err
	}
	return fault.mend()
}

// write returns when an edit of the writer that began after the call has been acknowledged.
func (f *faults) write(ctx context.Context) error {
	for {
		before := f.writer.acknowledged
		request := &history.Request{RPC: history.ApplyEdits, ID: fmt.Sprint("f", f.writer.known.newRequestNumber()),
			Edits: []history.Edit{{Action: history.Create, Value: f.writer.known.newValue()}}}
		if err := f.writer.perform(ctx, request); err != nil || f.writer.acknowledged > before {
			return err
		}
	}
}

// writeGaps returns the times from each fault to the first acknowledgement of an edit whose last attempt
// began after the fault.
func writeGaps(faults []time.Duration, operations []history.Operation) []time.Duration {
	gaps := make([]time.Duration, len(faults))
	for i, fault := range faults {
		gaps[i] = math.MaxInt64
		for _, o := range operations {
			isWrite := !o.Request.IsRead() && o.Answer != nil && o.Answer.Status == history.OK
			if isWrite && max(o.Call, o.LastAttempt) >= fault {
				gaps[i] = min(gaps[i], o.Return-fault)
			}
		}
	}
	return gaps
}
