// Package postgres has the database that the servers of a history share, and links to it that can be
// cut.
package postgres

import (
	"context"
	"fmt"
	"math/rand/v2"
	"net"
	"net/url"
	"os"
	"os/exec"
	"os/user"
	"path/filepath"
	"strconv"
	"strings"
	"time"
)

const (
	binaries = "/usr/lib/postgresql/15/bin"
	// What is committed is not synced to the disk: processes are killed, not machines.
	settings            = "-c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off -c max_connections=300 -c dynamic_shared_memory_type=mmap"
	firstPort, numPorts = 10_000, 20_000
	// A standby that takes longer than this to follow its primary hangs.
	standbyDeadline = 60 * time.Second
	standbyPause    = 50 * time.Millisecond
)

// Cluster is a primary, and perhaps a synchronous standby. One thread at a time.
type Cluster struct {
	user    string
	nodes   []*node
	primary int // index of the node
}

// node is one PostgreSQL server. Only nodes that StartPair has made have a folder.
type node struct {
	folder string
	port   string
}

func (n *node) address() string { return "127.0.0.1:" + n.port }

// At returns the cluster at a URI without a database, of which only the primary is known.
func At(uri string) (*Cluster, error) {
	parsed, err := url.Parse(uri)
	if err != nil {
		return nil, err
	}
	if parsed.Hostname() != "127.0.0.1" || parsed.Port() == "" {
		return nil, fmt.Errorf("%s: the host must be 127.0.0.1, with a port", uri)
	}
	return &Cluster{user: parsed.User.Username(), nodes: []*node{{port: parsed.Port()}}}, nil
}

// StartPair starts a primary and a synchronous standby, whose files are in an empty folder.
func StartPair(ctx context.Context, folder string) (*Cluster, error) {
	if err := giveToPostgres(folder); err != nil {
		return nil, err
	}
	c := &Cluster{user: "tests"}
	for _, name := range []string{"0", "1"} {
		c.nodes = append(c.nodes, &node{folder: filepath.Join(folder, name)})
	}
	first := c.nodes[0]
	if err := run("initdb", "-D", first.folder, "-U", c.user, "-A", "trust", "--no-sync"); err != nil {
		return nil, err
	}
	if err := first.start(); err != nil {
		return nil, err
	}
	if err := c.AddStandby(ctx); err != nil {
		c.Stop()
		return nil, err
	}
	return c, nil
}

// Addresses returns the addresses of all nodes, which stay the same.
func (c *Cluster) Addresses() []string {
	var addresses []string
	for _, node := range c.nodes {
		addresses = append(addresses, node.address())
	}
	return addresses
}

// URIOver returns the URI of a database for clients that reach the nodes at these addresses.
func (c *Cluster) URIOver(addresses []string, database string) string {
	uri := "postgresql://" + c.user + "@" + strings.Join(addresses, ",") + "/" + database
	if len(addresses) > 1 {
		uri += "?target_session_attrs=read-write"
	}
	return uri
}

// Query runs a statement at the primary, and returns what it prints.
func (c *Cluster) Query(database, sql string) (string, error) {
	uri := c.URIOver([]string{c.nodes[c.primary].address()}, database)
	output, err := exec.Command("psql", "-qAtX", "-d", uri, "-c", sql).CombinedOutput()
	if err != nil {
		return "", fmt.Errorf("%s: %w: %s", sql, err, output)
	}
	return strings.TrimSpace(string(output)), nil
}

// Primary returns the index of the primary among the addresses.
func (c *Cluster) Primary() int { return c.primary }

// KillPrimary kills all processes of the primary with SIGKILL.
func (c *Cluster) KillPrimary() error { return c.nodes[c.primary].kill() }

// Promote makes the standby the primary, which has no standby then. REQUIRES: StartPair or AddStandby
// came before, and KillPrimary.
func (c *Cluster) Promote() error {
	c.primary = 1 - c.primary
	return run("pg_ctl", "-D", c.nodes[c.primary].folder, "-w", "promote")
}

// AddStandby makes the other node a copy of the primary, and returns when it is a synchronous standby
// that has all commits.
func (c *Cluster) AddStandby(ctx context.Context) error {
	primary, standby := c.nodes[c.primary], c.nodes[1-c.primary]
	if err := os.RemoveAll(standby.folder); err != nil {
		return err
	}
	uri := c.URIOver([]string{primary.address()}, "postgres")
	if err := run("pg_basebackup", "-D", standby.folder, "-d", uri, "--write-recovery-conf", "--checkpoint=fast", "--no-sync"); err != nil {
		return err
	}
	if err := standby.start(); err != nil {
		return err
	}
	// Not before: a copy with this setting would wait for a standby of its own once it is promoted.
	for _, sql := range []string{"ALTER SYSTEM SET synchronous_standby_names = '*'", "SELECT pg_reload_conf()"} {
		if _, err := c.Query("postgres", sql); err != nil {
			return err
		}
	}
	return c.awaitSynchronous(ctx)
}

// awaitSynchronous returns when the standby has all commits, and will have all later ones.
func (c *Cluster) awaitSynchronous(ctx context.Context) error {
	const sql = "SELECT count(*) FROM pg_stat_replication WHERE sync_state = 'sync' AND flush_lsn >= pg_current_wal_lsn()"
	ctx, cancel := context.WithTimeout(ctx, standbyDeadline)
	defer cancel()
	// Twice, because the setting is in force a moment after it is seen.
	for seen := 0; seen < 2; {
		if found, err := c.Query("postgres", sql); err != nil {
			return err
		} else if found == "1" {
			seen++
		}
		select {
		case <-time.After(standbyPause):
		case <-ctx.Done():
			return fmt.Errorf("the standby does not become synchronous: %w", ctx.Err())
		}
	}
	return nil
}

// Stop ends the nodes that StartPair has started.
func (c *Cluster) Stop() {
	for _, node := range c.nodes {
		_ = run("pg_ctl", "-D", node.folder, "-m", "immediate", "stop")
	}
}

// start starts a node at its port, which is chosen at the first time.
func (n *node) start() error {
	for n.port == "" {
		// Not one that the system may give to a connection while the node is down.
		port := strconv.Itoa(firstPort + rand.IntN(numPorts))
		if listener, err := net.Listen("tcp", "127.0.0.1:"+port); err == nil {
			n.port = port
			_ = listener.Close()
		}
	}
	options := settings + " -c port=" + n.port
	log := n.folder + ".log"
	if err := run("pg_ctl", "-D", n.folder, "-w", "-l", log, "-o", options, "start"); err != nil {
		text, _ := os.ReadFile(log)
		return fmt.Errorf("%w; its log: %s", err, text)
	}
	return nil
}

// run runs a program of PostgreSQL, which refuses to be root.
func run(program string, arguments ...string) error {
	command := append([]string{filepath.Join(binaries, program)}, arguments...)
	if os.Geteuid() == 0 {
		command = append([]string{"runuser", "-u", "postgres", "--"}, command...)
	}
	// A file, because what pg_ctl starts would keep a pipe open.
	output, err := os.CreateTemp("", "hypermap-postgres-")
	if err != nil {
		return err
	}
	defer os.Remove(output.Name())
	defer output.Close()
	process := exec.Command(command[0], command[1:]...)
	process.Stdout, process.Stderr = output, output
	if err := process.Run(); err != nil {
		text, _ := os.ReadFile(output.Name())
		return fmt.Errorf("%s: %w: %s", program, err, text)
	}
	return nil
}

func giveToPostgres(folder string) error {
	if os.Geteuid() != 0 {
		return nil
	}
	postgres, err := user.Lookup("postgres")
	if err != nil {
		return err
	}
	id, err := strconv.Atoi(postgres.Uid)
	if err != nil {
		return err
	}
	return os.Chown(folder, id, -1)
}
