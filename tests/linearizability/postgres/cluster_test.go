package postgres

import (
	"context"
	"fmt"
	"os"
	"path/filepath"
	"testing"
)

func TestAPromotedStandbyHasAllCommits(t *testing.T) {
	if _, err := os.Stat(filepath.Join(binaries, "initdb")); err != nil {
		t.Skip("PostgreSQL 15 is not installed")
	}
	// The user of PostgreSQL can't enter the folders of the test.
	folder, err := os.MkdirTemp("", "hypermap-postgres-test-")
	if err != nil {
		t.Fatal(err)
	}
	defer os.RemoveAll(folder)
	c, err := StartPair(context.Background(), folder)
	if err != nil {
		t.Fatal(err)
	}
	defer c.Stop()
	query := func(sql, want string) {
		t.Helper()
		if got, err := c.Query("postgres", sql); err != nil || got != want {
			t.Fatalf("%s: got %q, %v, want %q", sql, got, err, want)
		}
	}
	query("CREATE TABLE numbers (n int)", "")
	for round := 1; round <= 2; round++ {
		query(fmt.Sprintf("INSERT INTO numbers VALUES (%d)", round), "")
		before := c.Primary()
		if err := c.KillPrimary(); err != nil {
			t.Fatal(err)
		}
		if err := c.Promote(); err != nil {
			t.Fatal(err)
		}
		if c.Primary() == before {
			t.Fatal("the primary is the one that was killed")
		}
		query("SELECT count(*) FROM numbers", fmt.Sprint(round))
		if err := c.AddStandby(context.Background()); err != nil {
			t.Fatal(err)
		}
		query("SELECT sync_state FROM pg_stat_replication", "sync")
	}
}

func TestTheURIOfAPairNamesBothNodes(t *testing.T) {
	one, err := At("postgresql://tests@127.0.0.1:5432")
	if err != nil {
		t.Fatal(err)
	}
	if got, want := one.URIOver(one.Addresses(), "maps"), "postgresql://tests@127.0.0.1:5432/maps"; got != want {
		t.Errorf("got %q, want %q", got, want)
	}
	two := &Cluster{user: "tests", nodes: []*node{{port: "1"}, {port: "2"}}}
	want := "postgresql://tests@127.0.0.1:1,127.0.0.1:2/maps?target_session_attrs=read-write"
	if got := two.URIOver(two.Addresses(), "maps"); got != want {
		t.Errorf("got %q, want %q", got, want)
	}
	if _, err := At("postgresql://tests@db.example.org:5432"); err == nil {
		t.Error("a cluster on another machine is taken")
	}
}
