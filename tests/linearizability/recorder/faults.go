package recorder

import (
	"context"
	"errors"
	"fmt"
	"math/rand/v2"
	"slices"
	"strings"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/postgres"
)

const (
	// lease is how long a server that has died or is frozen keeps its maps.
	lease = 3 * time.Second
	// maxFrozenBeyondLease is how long a server is frozen at most after its lease is over.
	maxFrozenBeyondLease = 3 * time.Second
	// maxCalm is the longest time between two faults.
	maxCalm = 2 * time.Second
	// maxUnpromoted is the longest time from the death of the primary to the promotion of its standby.
	maxUnpromoted = 2 * time.Second
)

// FaultKind is a kind of fault of several servers.
type FaultKind string

// The kinds of faults. All but Promote and Vanish happen to the server that owns the map.
const (
	// Kill is SIGKILL of the server, which starts again under its id, or another, or when another server
	// has taken the map over.
	Kill FaultKind = "kill"
	// Pause is SIGSTOP of the server until after its lease.
	Pause FaultKind = "pause"
	// Cut cuts the link between the server and the database, CutRequests and CutAnswers one direction of
	// it.
	Cut         FaultKind = "cut"
	CutRequests FaultKind = "cut_requests"
	CutAnswers  FaultKind = "cut_answers"
	// Promote is SIGKILL of the primary of the database, whose synchronous standby is promoted. Vanish is the
	// same, but nobody is told: connections to the primary are silent, as if its machine had lost its power.
	Promote FaultKind = "promote"
	Vanish  FaultKind = "vanish"
)

// FaultKinds returns all kinds.
func FaultKinds() []FaultKind {
	return []FaultKind{Kill, Pause, Cut, CutRequests, CutAnswers, Promote, Vanish}
}

// ParseFaultKinds returns the kinds in a list that is separated by commas.
func ParseFaultKinds(list string) ([]FaultKind, error) {
	var kinds []FaultKind
	for _, name := range strings.Split(list, ",") {
		if !slices.Contains(FaultKinds(), FaultKind(name)) {
			return nil, fmt.Errorf("no kind of fault %q; there are %v", name, FaultKinds())
		}
		kinds = append(kinds, FaultKind(name))
	}
	return kinds, nil
}

// faults are done to a fleet, one after another.
type faults struct {
	fleet     *fleet
	recording *recording
	random    *rand.Rand
	kinds     []FaultKind
	cutTime   time.Duration
	done      int // of this history and those before
	// writer is the client that finds out when the map can be written again.
	writer *connectedClient
	times  []faultTime
}

// faultTime is when a fault began.
type faultTime struct {
	kind FaultKind
	at   time.Duration
}

func (r *run) newFaults(f *fleet) (*faults, error) {
	writer, err := r.newClient(r.options.Clients + 2)
	if err != nil {
		return nil, err
	}
	writer.manner.giveUp = 0
	return &faults{
		fleet: f, recording: r.recording, random: r.random(0), kinds: r.options.Faults, cutTime: r.options.CutTime,
		done: r.options.FaultsDone, writer: writer,
	}, nil
}

// injectAll does this many faults, at any time between two renewals of the lease.
func (f *faults) injectAll(ctx context.Context, number int) error {
	for range number {
		if err := pause(ctx, randomTime(f.random, maxCalm)); err != nil {
			return nil // The run has ended, and tells why.
		}
		if err := f.inject(ctx, f.kinds[f.done%len(f.kinds)]); err != nil {
			return err
		}
		f.done++
	}
	return pause(ctx, randomTime(f.random, maxCalm))
}

// inject does one fault, and returns when the map was written and all servers run again.
func (f *faults) inject(ctx context.Context, kind FaultKind) error {
	owner, err := f.fleet.owner(ctx)
	if err != nil {
		return err
	}
	var next fault
	switch kind {
	case Kill:
		next = f.kill(owner)
	case Pause:
		next = f.pause(ctx, owner)
	case Promote:
		next = f.promote(ctx)
	case Vanish:
		next = f.vanish(ctx)
	default:
		next = f.cut(ctx, owner, kind)
	}
	next.kind = kind
	return f.do(ctx, next)
}

func (f *faults) kill(owner int) fault {
	server, id := f.fleet.servers[owner], f.fleet.id(owner)
	kill := func() error { server.kill(); return nil }
	switch f.random.IntN(3) {
	case 0:
		return fault{what: "SIGKILL of " + id + ", which starts again at once", begin: kill, goOn: server.start}
	case 1:
		f.fleet.restarts++
		other := fmt.Sprintf("%s%d", id[:1], f.fleet.restarts)
		return fault{what: "SIGKILL of " + id + ", which starts again as " + other, begin: kill, goOn: func() error {
			f.fleet.name(owner, other)
			return server.start()
		}}
	}
	return fault{what: "SIGKILL of " + id, begin: kill, mend: server.start}
}

func (f *faults) pause(ctx context.Context, owner int) fault {
	server, id := f.fleet.servers[owner], f.fleet.id(owner)
	frozen := lease + randomTime(f.random, maxFrozenBeyondLease)
	return fault{what: fmt.Sprintf("SIGSTOP of %s for %s", id, frozen), begin: server.freeze, goOn: func() error {
		if err := pause(ctx, frozen); err != nil {
			return err
		}
		f.recording.addEvent("SIGCONT of " + id)
		return server.thaw()
	}}
}

// cut cuts the links of a server. Afterwards its connections go on or are lost.
func (f *faults) cut(ctx context.Context, owner int, kind FaultKind) fault {
	directions := []postgres.Direction{postgres.Requests, postgres.Answers}
	switch kind {
	case CutRequests:
		directions = directions[:1]
	case CutAnswers:
		directions = directions[1:]
	}
	links := f.fleet.links[owner]
	begin := func() error {
		for _, link := range links {
			for _, direction := range directions {
				link.Cut(direction)
			}
		}
		return nil
	}
	keep := f.random.IntN(2) == 0
	what := fmt.Sprintf("%s of the link of %s for %s", kind, f.fleet.id(owner), f.cutTime)
	return fault{what: what, begin: begin, goOn: func() error {
		err := pause(ctx, f.cutTime)
		f.recording.addEvent(fmt.Sprintf("the link works again; its connections go on: %t", keep))
		for _, link := range links {
			link.Mend(keep)
		}
		return err
	}}
}

func (f *faults) promote(ctx context.Context) fault {
	cluster, unpromoted := f.fleet.cluster, randomTime(f.random, maxUnpromoted)
	return fault{what: "SIGKILL of the primary", begin: cluster.KillPrimary, goOn: func() error {
		if err := pause(ctx, unpromoted); err != nil {
			return err
		}
		f.recording.addEvent("promotion of the standby")
		return cluster.Promote()
	}, mend: func() error { return cluster.AddStandby(ctx) }}
}

func (f *faults) vanish(ctx context.Context) fault {
	var links []*postgres.Link
	for _, ofServer := range f.fleet.links {
		links = append(links, ofServer[f.fleet.cluster.Primary()])
	}
	dead := f.promote(ctx)
	return fault{what: dead.what + ", of which nobody is told", begin: func() error {
		for _, link := range links {
			link.Cut(postgres.Requests)
			link.Cut(postgres.Answers)
		}
		return dead.begin()
	}, goOn: dead.goOn, mend: func() error {
		err := dead.mend()
		for _, link := range links {
			link.Mend(false)
		}
		return err
	}}
}

// fault is one fault.
type fault struct {
	kind  FaultKind
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
	f.times = append(f.times, faultTime{fault.kind, f.recording.now()})
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
