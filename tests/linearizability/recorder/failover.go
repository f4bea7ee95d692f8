package recorder

import (
	"context"
	"fmt"
	"math"
	"math/rand/v2"
	"time"

	"hypermap-linearizability/history"
)

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
	if err := r.contend(ctx, faults); err != nil {
		return nil, err
	}
	watchers.await(r.known.newestRevision())
	if err := context.Cause(ctx); err != nil {
		return nil, err
	}
	return &history.History{
		Seed: r.options.Seed, Number: r.options.Number, Initial: initial, Kills: len(faults.times),
		Events: r.recording.events, WriteGaps: writeGaps(faults.times, r.recording.operations), Operations: r.recording.sorted(),
		Told: watchers.revisions, WatchFaults: watchers.faults,
	}, nil
}

// contend lets the clients make operations during the faults, and reads what is stored afterwards.
func (r *run) contend(ctx context.Context, faults *faults) error {
	err := r.runClients(ctx, func() error {
		defer r.recording.stop()
		return faults.injectAll(ctx, 1+faults.random.IntN(r.options.MaxKills))
	})
	if err != nil {
		return err
	}
	r.recording.addEvent("SIGKILL of all servers")
	faults.fleet.kill()
	if err := faults.fleet.start(); err != nil {
		return err
	}
	return r.readAtTheEnd(ctx)
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
	if err := makeIdleMaps(ctx, connections[0], r.options.IdleMaps); err != nil {
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

// makeIdleMaps makes maps that nobody writes. Their names come before that of the map that is written, so that
// it is the last one that another server takes over.
func makeIdleMaps(ctx context.Context, c *connection, number int) error {
	for i := range number {
		name := fmt.Sprintf("idle-%04d", i)
		if err := c.change(ctx, "CatalogService.CreateMap", object{"map": name, "requestId": name}); err != nil {
			return err
		}
	}
	return nil
}

// writeGaps returns the times from each fault to the first acknowledgement of an edit whose last attempt
// began after the fault, by the kind of the fault.
func writeGaps(faults []faultTime, operations []history.Operation) map[string][]time.Duration {
	gaps := map[string][]time.Duration{}
	for _, fault := range faults {
		gap := time.Duration(math.MaxInt64)
		for _, o := range operations {
			isWrite := !o.Request.IsRead() && o.Answer != nil && o.Answer.Status == history.OK
			if isWrite && max(o.Call, o.LastAttempt) >= fault.at {
				gap = min(gap, o.Return-fault.at)
			}
		}
		gaps[string(fault.kind)] = append(gaps[string(fault.kind)], gap)
	}
	return gaps
}
