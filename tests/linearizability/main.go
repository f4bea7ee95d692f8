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
	"strings"
	"syscall"
	"time"

	"hypermap-linearizability/recorder"
)

type config struct {
	recorder.Options
	histories int
	timeout   time.Duration
	artifacts string
	replay    string
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
	flags.IntVar(&cfg.Operations, "operations", 300, "number of operations of a history")
	flags.IntVar(&cfg.Places, "places", 4, "number of places at which the objects are; fewer places mean more contention")
	flags.IntVar(&cfg.MaxKills, "kills", 3, "the server is killed 1 to this many times in a history, the last time after all edits")
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

func (c *config) check(arguments []string) error {
	switch {
	case len(arguments) > 0:
		return fmt.Errorf("unexpected argument %q", arguments[0])
	case c.histories < 1 || c.Clients < 1 || c.Operations < 1 || c.Places < 1 || c.MaxKills < 1:
		return errors.New("--histories, --clients, --operations, --places and --kills must be at least 1")
	case c.timeout <= 0:
		return errors.New("--timeout must be positive")
	}
	return recorder.CheckPlant(c.Plant)
}
