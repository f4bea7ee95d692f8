// hypermap_linearizability checks that a map is linearizable while clients contend for it and the
// server is killed: that each operation takes effect at one moment between its call and its return, as
// if there were one map and one operation at a time.
//
// Each history is made by a hypermapd of its own, on an empty folder (package recorder). Clients, each
// with its own connection, put, delete and create objects at a few places, alone and in batches, with
// and without conditions on versions, and read single places, the whole layer, past revisions and the
// newest revision. Meanwhile the server is killed with SIGKILL and started again. Clients repeat a
// request of unknown outcome with its request id until they are answered, or give it up, after which it
// may take effect at any time or never. They also send each other's requests again, while these are under
// way or later, use ids again for other requests, end calls by short deadlines, and lose answers.
//
// With several servers (--servers) that share a database of PostgreSQL, clients send each attempt to any
// of them, and all reads are linearizable queries. Faults of several kinds come in turn (--faults): the server
// that owns the map is killed with SIGKILL, and starts again under its id, or another, or when another server
// has taken the map over; it is stopped with SIGSTOP until after its lease; its link to the database is cut,
// also one way; or the primary of the database is killed, and its synchronous standby promoted. Watches go from
// server to server meanwhile, and must be told of each revision once and in order.
//
// Porcupine then searches an order of the operations that agrees with their times and with a sequential
// model of a map (package model). The model knows what docs/protocol.md promises: revisions without
// gaps, batches as a whole or not at all, conditions, receipts, and past revisions as they were.
//
// The seed determines which requests the clients choose and when the server is killed, but not how
// threads and processes are scheduled. So a run is not repeated exactly by its seed. A history that is not
// linearizable is stored in a file, which can be judged again (--replay).
//
// Faults can be planted (--plant), to show that they are found. SIGKILL leaves the operating system's
// cache as it is: this program does not show that edits survive a power cut.
//
// The last line of the output is one JSON object with the counts and "holds". The exit code is 0 if it
// holds.
package main

import (
	"context"
	"errors"
	"flag"
	"fmt"
	"math/rand/v2"
	"os"
	"os/signal"
	"slices"
	"strings"
	"syscall"
	"time"

	"hypermap-linearizability/recorder"
)

type config struct {
	recorder.Options
	histories   int
	faults      string
	failovers   int
	postgres    string
	maxWriteGap time.Duration
	timeout     time.Duration
	artifacts   string
	replay      string
}

func main() {
	ctx, stop := signal.NotifyContext(context.Background(), syscall.SIGINT, syscall.SIGTERM)
	defer stop()
	cfg, err := parseFlags(os.Args[1:])
	if errors.Is(err, flag.ErrHelp) {
		return
	}
	if err != nil {
		os.Exit(2) // parseFlags has printed the error.
	}
	holds, err := run(ctx, cfg)
	if err != nil {
		fmt.Fprintln(os.Stderr, "hypermap_linearizability:", err)
	}
	if err != nil || !holds {
		os.Exit(1)
	}
}

func parseFlags(args []string) (config, error) {
	var cfg config
	flags := flag.NewFlagSet("hypermap_linearizability", flag.ContinueOnError)
	flags.StringVar(&cfg.Server, "server", "build/bin/hypermapd", "the server, a `PATH`")
	flags.Uint64Var(&cfg.Seed, "seed", rand.Uint64N(1_000_000), "random seed")
	flags.IntVar(&cfg.histories, "histories", 20, "number of histories")
	flags.IntVar(&cfg.Clients, "clients", 16, "number of clients")
	flags.IntVar(&cfg.Operations, "operations", 300, "number of operations of a history of one server; those of several end with the last fault")
	flags.IntVar(&cfg.Places, "places", 4, "number of places at which the objects are; fewer places mean more contention")
	flags.IntVar(&cfg.MaxKills, "kills", 3, "the server is killed 1 to this many times in a history, the last time after all edits")
	flags.IntVar(&cfg.Servers, "servers", 1, "number of servers; several share a database, and --kills is the number of faults of the map's owner")
	flags.StringVar(&cfg.postgres, "postgres", os.Getenv("HYPERMAP_TEST_POSTGRES"), "with several servers: the `URI` of a PostgreSQL cluster on 127.0.0.1, without a database; promotions have a cluster of their own")
	flags.IntVar(&cfg.IdleMaps, "idle_maps", 0, "with several servers: number of further maps, which a server that takes over takes before the one that is written")
	flags.StringVar(&cfg.faults, "faults", "kill,pause", fmt.Sprintf("with several servers: the kinds of faults, of %v", recorder.FaultKinds()))
	flags.DurationVar(&cfg.CutTime, "cut_time", 10*time.Second, "with several servers: for how long a link is cut")
	flags.IntVar(&cfg.Watchers, "watchers", 20, "with several servers: number of watches, which are resumed by other servers")
	flags.IntVar(&cfg.failovers, "failovers", 0, "with several servers: makes histories until there were this many faults, in place of --histories")
	flags.DurationVar(&cfg.maxWriteGap, "max_write_gap", 5*time.Second, "with several servers: the longest time that a map may be without writes after its owner was killed, in the 99th percentile")
	flags.StringVar(&cfg.Plant, "plant", "", "plant a fault, which must be found: "+strings.Join(recorder.Plants(), ", "))
	flags.DurationVar(&cfg.timeout, "timeout", time.Minute, "time for judging a history; one that takes longer counts as undecided, and nothing is proved")
	flags.StringVar(&cfg.artifacts, "artifacts", "linearizability", "folder for histories that are not linearizable, a `DIR`")
	flags.StringVar(&cfg.replay, "replay", "", "judge the history in this `FILE` again, without a server")
	if err := flags.Parse(args); err != nil {
		return config{}, err
	}
	if err := cfg.check(flags.Args()); err != nil {
		fmt.Fprintln(flags.Output(), "hypermap_linearizability:", err)
		return config{}, err
	}
	return cfg, nil
}

// isEnough reports whether no more histories are to be made.
func (c *config) isEnough(made *counts) bool {
	// A planted fault is found when the judge has found it.
	if made.Violations > 0 || c.Plant == "" && made.numWrong() > 0 {
		return true
	}
	if c.failovers > 0 {
		return made.Failovers >= c.failovers
	}
	return made.Histories >= c.histories
}

func (c *config) check(arguments []string) error {
	switch {
	case len(arguments) > 0:
		return fmt.Errorf("unexpected argument %q", arguments[0])
	case c.histories < 1 || c.Clients < 1 || c.Operations < 1 || c.Places < 1 || c.MaxKills < 1:
		return errors.New("--histories, --clients, --operations, --places and --kills must be at least 1")
	case c.Servers < 1 || c.Servers > 26:
		return errors.New("--servers must be at least 1, and at most 26")
	case c.CutTime <= 0:
		return errors.New("--cut_time must be positive")
	case c.failovers > 0 && c.Servers == 1:
		return errors.New("--failovers needs several --servers")
	case c.timeout <= 0:
		return errors.New("--timeout must be positive")
	}
	var err error
	if c.Faults, err = recorder.ParseFaultKinds(c.faults); err != nil {
		return err
	}
	if c.Servers > 1 && c.postgres == "" && !c.promotes() && c.replay == "" {
		return errors.New("several servers need --postgres")
	}
	return recorder.CheckPlant(c.Plant)
}

// promotes reports whether a standby is promoted, which needs a cluster of this program's own.
func (c *config) promotes() bool {
	return slices.Contains(c.Faults, recorder.Promote) || slices.Contains(c.Faults, recorder.Vanish)
}
