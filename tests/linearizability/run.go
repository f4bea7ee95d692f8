package main

import (
	"context"
	"errors"
	"fmt"
	"os"
	"path/filepath"
	"time"

	"hypermap-linearizability/history"
	"hypermap-linearizability/model"
	"hypermap-linearizability/postgres"
	"hypermap-linearizability/recorder"
)

// historiesPerLine is the number of histories after which a line tells the progress.
const historiesPerLine = 50

// fleetHistoriesPerLine is the same for those of several servers, which take ten seconds or more.
const fleetHistoriesPerLine = 5

// run makes and judges histories until one is not linearizable, or judges a stored one. It reports
// whether all are linearizable, and prints the counts.
func run(ctx context.Context, cfg config) (bool, error) {
	counts := counts{Proof: "linearizable", Seed: cfg.Seed, Clients: cfg.Clients, Plant: cfg.Plant}
	var err error
	if cfg.replay != "" {
		err = replay(cfg, &counts)
	} else {
		err = makeHistories(ctx, cfg, &counts)
	}
	if err != nil {
		counts.Error = err.Error()
	}
	holds := counts.judge(cfg.maxWriteGap)
	fmt.Println(counts.line())
	return holds, err
}

func makeHistories(ctx context.Context, cfg config, counts *counts) error {
	fmt.Printf("seed %d\n", cfg.Seed)
	if cfg.Servers > 1 {
		cluster, remove, err := openCluster(ctx, cfg)
		if err != nil {
			return err
		}
		defer remove()
		cfg.Cluster = cluster
	}
	start := time.Now()
	for number := 1; !cfg.isEnough(counts); number++ {
		cfg.Number, cfg.FaultsDone = number, counts.Failovers
		if err := makeHistory(ctx, cfg, counts); err != nil {
			return fmt.Errorf("history %d of seed %d: %w", number, cfg.Seed, err)
		}
		if number%historiesPerLine == 0 || cfg.Servers > 1 && number%fleetHistoriesPerLine == 0 {
			fmt.Printf("%d histories after %d s\n", number, int(time.Since(start).Seconds()))
		}
	}
	return nil
}

// openCluster returns the cluster that the servers share, and what removes it.
func openCluster(ctx context.Context, cfg config) (*postgres.Cluster, func(), error) {
	if !cfg.promotes() {
		cluster, err := postgres.At(cfg.postgres)
		return cluster, func() {}, err
	}
	folder, err := os.MkdirTemp("", "hypermap-linearizability-postgres-")
	if err != nil {
		return nil, nil, err
	}
	cluster, err := postgres.StartPair(ctx, folder)
	if err != nil {
		return nil, nil, fmt.Errorf("%w; the files of PostgreSQL are in %s", err, folder)
	}
	return cluster, func() {
		cluster.Stop()
		_ = os.RemoveAll(folder)
	}, nil
}

// makeHistory makes and judges a history. The server's files are kept if they may tell why it could not
// be made or is not linearizable.
func makeHistory(ctx context.Context, cfg config, counts *counts) error {
	folder, err := os.MkdirTemp("", "hypermap-linearizability-")
	if err != nil {
		return err
	}
	cfg.Folder = folder
	h, err := recorder.Record(ctx, cfg.Options)
	switch {
	case ctx.Err() != nil:
		return errors.Join(err, os.RemoveAll(folder))
	case err != nil:
		return fmt.Errorf("%w; the server's files are in %s", err, folder)
	}
	holds, err := judge(h, cfg, counts)
	if err != nil {
		return err
	}
	if !holds && cfg.Plant == "" {
		fmt.Printf("the server's files are in %s\n", folder)
		return nil
	}
	return os.RemoveAll(folder)
}

func replay(cfg config, counts *counts) error {
	h, err := history.ReadFile(cfg.replay)
	if err != nil {
		return err
	}
	counts.Seed, counts.Clients = h.Seed, 0
	_, err = judge(h, cfg, counts)
	return err
}

// judge judges a history and counts it, and reports whether it is linearizable. One that is not, or that
// is undecided, is stored.
func judge(h *history.History, cfg config, counts *counts) (bool, error) {
	verdict := model.Judge(h, cfg.timeout)
	before := counts.numWrong()
	counts.add(h, verdict)
	if verdict != model.Undecided && counts.numWrong() == before {
		return true, nil
	}
	folder := filepath.Join(cfg.artifacts, cfg.Plant, fmt.Sprintf("seed-%d-history-%d", h.Seed, h.Number))
	if err := store(h, folder, cfg.timeout); err != nil {
		return false, err
	}
	what := "is not linearizable, or its watches are wrong"
	if verdict == model.Undecided {
		what = fmt.Sprintf("could not be judged within %s", cfg.timeout)
	}
	fmt.Printf("history %d of seed %d %s: see history.html and history.jsonl in %s\n", h.Number, h.Seed, what, folder)
	return false, nil
}

func store(h *history.History, folder string, timeout time.Duration) error {
	if err := os.MkdirAll(folder, 0o755); err != nil {
		return err
	}
	if err := h.WriteFile(filepath.Join(folder, "history.jsonl")); err != nil {
		return err
	}
	return model.Visualize(h, timeout, filepath.Join(folder, "history.html"))
}
