package recorder

import (
	"context"
	"fmt"
	"math/rand/v2"
	"os"
	"path/filepath"
	"sync"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/postgres"
)

// fleet is several servers that share a database, of which one owns the map.
type fleet struct {
	servers  []*server
	links    [][]*postgres.Link // of each server to each node of the cluster
	cluster  *postgres.Cluster
	database string
	restarts int // with other ids

	mutex sync.Mutex
	ids   []string // of the servers
}

// spread is the manner of a client that sends each attempt to any server, which may be frozen. A map may
// have no owner for some seconds.
var spread = manner{deadline: time.Second, giveUp: 0.005, pause: 20 * time.Millisecond, pace: 400 * time.Millisecond, spreads: true}

// newFleet makes a database, and servers that do not run yet.
func newFleet(options Options, onDeath func(error)) (*fleet, error) {
	f := &fleet{cluster: options.Cluster, database: fmt.Sprintf("linearizability_%d_%d_%d", os.Getpid(), options.Seed, options.Number)}
	if _, err := f.cluster.Query("postgres", "CREATE DATABASE "+f.database+" STRATEGY FILE_COPY"); err != nil {
		return nil, err
	}
	for i := range options.Servers {
		id := string(rune('a' + i))
		folder := filepath.Join(options.Folder, id)
		if err := os.MkdirAll(folder, 0o755); err != nil {
			return nil, err
		}
		if err := f.addLinks(); err != nil {
			return nil, err
		}
		f.ids = append(f.ids, "")
		f.servers = append(f.servers, newServer(options.Server, filepath.Join(folder, "data"), filepath.Join(folder, "server.log"), onDeath))
		f.name(i, id)
	}
	return f, nil
}

// addLinks makes the links of one more server.
func (f *fleet) addLinks() error {
	var links []*postgres.Link
	for _, address := range f.cluster.Addresses() {
		link, err := postgres.NewLink(address)
		if err != nil {
			return err
		}
		links = append(links, link)
	}
	f.links = append(f.links, links)
	return nil
}

// id returns the id of a server.
func (f *fleet) id(server int) string {
	f.mutex.Lock()
	defer f.mutex.Unlock()
	return f.ids[server]
}

// name gives a server that is down an id.
func (f *fleet) name(server int, id string) {
	f.mutex.Lock()
	defer f.mutex.Unlock()
	f.ids[server] = id
	var addresses []string
	for _, link := range f.links[server] {
		addresses = append(addresses, link.Address())
	}
	f.servers[server].flags = []string{"--store=" + f.cluster.URIOver(addresses, f.database), "--server_id=" + id}
}

func (f *fleet) start() error {
	for _, server := range f.servers {
		if err := server.start(); err != nil {
			return err
		}
	}
	return nil
}

func (f *fleet) kill() {
	for _, server := range f.servers {
		server.kill()
	}
}

// remove ends the servers and removes the database.
func (f *fleet) remove() {
	f.kill()
	for _, links := range f.links {
		for _, link := range links {
			link.Close()
		}
	}
	_, _ = f.cluster.Query("postgres", "DROP DATABASE "+f.database+" WITH (FORCE)")
}

// owner returns the index of the server that owns the map and lives.
func (f *fleet) owner(ctx context.Context) (int, error) {
	const sql = "SELECT owner FROM hypermap.maps JOIN hypermap.servers AS s ON s.id = owner" +
		" WHERE name = '" + mapName + "' AND lease_until > clock_timestamp()"
	for began := time.Now(); time.Since(began) < startDeadline; {
		id, err := f.cluster.Query(f.database, sql)
		if err != nil {
			return 0, err
		}
		for i, server := range f.servers {
			if f.id(i) == id && server.isUp() {
				return i, nil
			}
		}
		if err := pause(ctx, 50*time.Millisecond); err != nil {
			return 0, err
		}
	}
	return 0, fmt.Errorf("the map has had no owner for %s", startDeadline)
}

// fleetCaller sends each call to any of the servers that run.
type fleetCaller struct {
	fleet   *fleet
	callers []caller
	random  *rand.Rand
}

func (c fleetCaller) call(ctx context.Context, request *history.Request) (*history.Answer, error) {
	return c.callers[c.fleet.anyUp(c.random)].call(ctx, request)
}

// anyUp returns the index of a random server that runs or is frozen, or of any if there is none.
func (f *fleet) anyUp(random *rand.Rand) int {
	chosen := random.IntN(len(f.servers))
	for i := 0; i < len(f.servers) && !f.servers[chosen].isUp(); i++ {
		chosen = (chosen + 1) % len(f.servers)
	}
	return chosen
}

// connectAll connects to all servers.
func (f *fleet) connectAll(s *schema) ([]*connection, error) {
	var connections []*connection
	for _, server := range f.servers {
		connection, err := connect(s, server.currentAddress)
		if err != nil {
			closeAll(connections)
			return nil, err
		}
		connections = append(connections, connection)
	}
	return connections, nil
}

func closeAll(connections []*connection) {
	for _, connection := range connections {
		connection.close()
	}
}

// dial returns calls of all servers.
func (f *fleet) dial(s *schema, random *rand.Rand) (caller, func(), error) {
	connections, err := f.connectAll(s)
	if err != nil {
		return nil, nil, err
	}
	calls := fleetCaller{fleet: f, random: random}
	for _, connection := range connections {
		calls.callers = append(calls.callers, serverCaller{connection})
	}
	return calls, func() { closeAll(connections) }, nil
}
