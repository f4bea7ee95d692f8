// Package recorder runs a hypermapd and clients that contend for a few objects of one map, kills the
// server again and again, and records what the clients asked and were answered.
package recorder

import (
	"context"
	"errors"
	"math/rand/v2"
	"path/filepath"
	"slices"
	"sync"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/postgres"
)

// Options are the sizes of a history.
type Options struct {
	Server     string // path of hypermapd
	Folder     string // an empty folder, for the server's data and log
	Seed       uint64
	Number     int // of the history; the random choices come from Seed and Number
	Clients    int
	Operations int
	Places     int
	MaxKills   int    // 1 to this many, the last of them after the last edit
	Plant      string // a fault, see newPlant; empty: none
	// With Servers > 1 they share a database, and each kill is a fault, see fleet.
	Servers int
	// The rest is of several servers.
	Cluster  *postgres.Cluster
	Watchers int
	IdleMaps int // beside the map that is written
	// The kinds of faults, which come in turn, and the number of those before this history.
	Faults     []FaultKind
	FaultsDone int
	CutTime    time.Duration // of a link
}

// maxKillDelay bounds the time between the operation that a kill waits for, and the kill. It is about
// the time of a commit.
const maxKillDelay = 4 * time.Millisecond

// run is the making of one history.
type run struct {
	options   Options
	server    *server
	schema    *schema
	plant     plant
	recording *recording
	known     *knowledge
	// dial returns the calls of a client, and what closes its connections.
	dial func(*rand.Rand) (caller, func(), error)
	// awaitUp returns when a server runs.
	awaitUp func(context.Context) error
	manner  manner
	// fail ends the context of the run.
	fail context.CancelCauseFunc
}

// Record makes a history. An error means that it could not be made, for example because the server
// does not start again after a kill or answers with an error that no request should get.
func Record(ctx context.Context, options Options) (*history.History, error) {
	schema, err := loadSchema()
	if err != nil {
		return nil, err
	}
	plant, err := newPlant(options.Plant)
	if err != nil {
		return nil, err
	}
	ctx, fail := context.WithCancelCause(ctx)
	defer fail(nil)
	r := &run{options: options, schema: schema, plant: plant, fail: fail}
	record := r.recordServer
	if options.Servers > 1 {
		record = r.recordFleet
	}
	h, err := record(ctx)
	if cause := context.Cause(ctx); cause != nil {
		return nil, cause // Of the error, too.
	}
	return h, err
}

// random returns the random numbers of one part of the run, such as a client.
func (r *run) random(part int) *rand.Rand {
	return rand.New(rand.NewPCG(r.options.Seed, uint64(r.options.Number)<<32|uint64(part)))
}

// recordServer makes a history with one server.
func (r *run) recordServer(ctx context.Context) (*history.History, error) {
	r.server = newServer(r.options.Server, filepath.Join(r.options.Folder, "data"), filepath.Join(r.options.Folder, "server.log"), r.fail)
	defer r.server.kill()
	r.dial = func(*rand.Rand) (caller, func(), error) { return dialServer(r.schema, r.server) }
	r.awaitUp, r.manner = r.server.awaitUp, toOne
	if err := r.server.start(); err != nil {
		return nil, err
	}
	first, err := connect(r.schema, r.server.currentAddress)
	if err != nil {
		return nil, err
	}
	defer first.close()
	initial, err := makeMap(ctx, first, r.options.Places)
	if err != nil {
		return nil, err
	}
	r.recording, r.known = newRecording(r.options.Operations), newKnowledge(initial)
	killer := r.random(0)
	kills := 1 + killer.IntN(r.options.MaxKills)
	times := r.killTimes(killer, kills-1)
	err = r.runClients(ctx, func() error { return r.killAt(ctx, killer, times) })
	if err != nil {
		return nil, err
	}
	if err := r.restart(); err != nil {
		return nil, err
	}
	if err := r.readAtTheEnd(ctx); err != nil {
		return nil, err
	}
	return &history.History{
		Seed: r.options.Seed, Number: r.options.Number, Initial: initial, Kills: kills,
		Events: r.recording.events, Operations: r.recording.sorted(),
	}, nil
}

// runClients lets the clients make the operations, and calls `harm` meanwhile.
func (r *run) runClients(ctx context.Context, harm func() error) error {
	var clients sync.WaitGroup
	for i := range r.options.Clients {
		clients.Add(1)
		go func() {
			defer clients.Done()
			r.failIf(r.runClient(ctx, i+1))
		}()
	}
	r.failIf(harm())
	clients.Wait()
	return context.Cause(ctx)
}

// failIf ends the run, unless err is nil. The first error is the cause of the others.
func (r *run) failIf(err error) {
	if err != nil {
		r.fail(err)
	}
}

func (r *run) runClient(ctx context.Context, part int) error {
	c, err := r.newClient(part)
	if err != nil {
		return err
	}
	defer c.close()
	return c.run(ctx)
}

// connectedClient is a client with the connections that it owns.
type connectedClient struct {
	client
	close func()
}

func (r *run) newClient(part int) (*connectedClient, error) {
	random := r.random(part)
	calls, closeCalls, err := r.dial(random)
	if err != nil {
		return nil, err
	}
	return &connectedClient{client{
		number:    r.recording.newClient(),
		random:    random,
		workload:  &workload{random: random, places: r.options.Places, known: r.known, linearizable: r.options.Servers > 1},
		caller:    lossyCaller{r.plant.before(calls, random), random},
		known:     r.known,
		recording: r.recording,
		awaitUp:   r.awaitUp,
		manner:    r.manner,
	}, closeCalls}, nil
}

// dialServer returns calls of one server.
func dialServer(s *schema, of *server) (caller, func(), error) {
	connection, err := connect(s, of.currentAddress)
	if err != nil {
		return nil, nil, err
	}
	return serverCaller{connection}, connection.close, nil
}

// killTimes returns channels that are closed when random operations begin, in their order.
func (r *run) killTimes(random *rand.Rand, kills int) []<-chan struct{} {
	operations := make([]int64, kills)
	for i := range operations {
		operations[i] = 1 + random.Int64N(int64(r.options.Operations))
	}
	slices.Sort(operations)
	times := make([]<-chan struct{}, kills)
	for i, operation := range operations {
		times[i] = r.recording.mark(operation)
	}
	return times
}

// killAt kills the server and starts it again at each of the times, or rather a random moment later, so
// that all steps of a commit are hit.
func (r *run) killAt(ctx context.Context, random *rand.Rand, times []<-chan struct{}) error {
	for _, began := range times {
		select {
		case <-began:
		case <-ctx.Done():
			return nil // A client has failed, and tells why.
		}
		time.Sleep(randomTime(random, maxKillDelay))
		if err := r.restart(); err != nil {
			return err
		}
	}
	return nil
}

func (r *run) restart() error {
	r.recording.addEvent("SIGKILL")
	r.server.kill()
	r.recording.addEvent("the server has ended")
	if err := r.plant.afterKill(r.server.dataDir); err != nil {
		return err
	}
	err := r.server.start()
	r.recording.addEvent("the server is ready")
	return err
}

// readAtTheEnd reads what is stored, after the servers were killed once more.
func (r *run) readAtTheEnd(ctx context.Context) error {
	c, err := r.newClient(r.options.Clients + 1)
	if err != nil {
		return err
	}
	defer c.close()
	questions := []*history.Request{{RPC: history.QueryArea}, {RPC: history.GetMap}}
	if r.options.Servers > 1 {
		questions = []*history.Request{{RPC: history.QueryArea, Linearizable: true}}
	}
	for _, question := range questions {
		before := len(r.recording.operations)
		for range 100 { // A read with a short deadline may get no answer.
			if err := c.perform(ctx, question); err != nil {
				return err
			}
			if len(r.recording.operations) > before {
				break
			}
			if err := pause(ctx, c.manner.pause); err != nil {
				return err
			}
		}
		if len(r.recording.operations) == before {
			return errors.New("the last read got no answer")
		}
	}
	return nil
}

// makeMap makes the map with an object at each place, and returns it as the server does.
func makeMap(ctx context.Context, c *connection, places int) (history.Map, error) {
	if err := c.change(ctx, "CatalogService.CreateMap", object{"map": mapName, "requestId": "create"}); err != nil {
		return history.Map{}, err
	}
	edits := []object{{"createLayer": object{"layer": object{"name": layerName, "kind": "LAYER_KIND_SEMANTIC"}}}}
	for place := range places {
		edits = append(edits, encodeEdit(history.Edit{Action: history.Create, Place: place, Value: int64(place) + 1}))
	}
	if err := c.change(ctx, "EditService.ApplyEdits", object{"map": mapName, "requestId": "fill", "edits": edits}); err != nil {
		return history.Map{}, err
	}
	// By now another server may own the map.
	answer, err := serverCaller{c}.send(ctx, &history.Request{RPC: history.QueryArea, Linearizable: true})
	if err != nil {
		return history.Map{}, err
	}
	return history.Map{
		Incarnation: answer.Incarnation,
		Revision:    answer.Revision,
		NextID:      int64(places) + 1,
		Objects:     answer.Objects,
	}, nil
}
