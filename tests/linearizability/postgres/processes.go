package postgres

import (
	"errors"
	"fmt"
	"os"
	"os/exec"
	"path/filepath"
	"strconv"
	"strings"
	"syscall"
)

// shmLine is the index of the line of postmaster.pid that has the key and id of the shared memory.
const shmLine = 6

// kill kills the processes of a node with SIGKILL, and removes what they leave in the system.
func (n *node) kill() error {
	content, err := os.ReadFile(filepath.Join(n.folder, "postmaster.pid"))
	if err != nil {
		return err
	}
	lines := strings.Split(string(content), "\n")
	postmaster, err := strconv.Atoi(lines[0])
	if err != nil || len(lines) <= shmLine {
		return fmt.Errorf("postmaster.pid: %q", content)
	}
	// It starts no more processes once it is stopped.
	if err := syscall.Kill(postmaster, syscall.SIGSTOP); err != nil {
		return err
	}
	children, err := childrenOf(postmaster)
	if err != nil {
		return err
	}
	for _, process := range append(children, postmaster) {
		if err := syscall.Kill(process, syscall.SIGKILL); err != nil && !errors.Is(err, syscall.ESRCH) {
			return err
		}
	}
	// A segment of a few bytes, by which PostgreSQL sees whether processes are left.
	if fields := strings.Fields(lines[shmLine]); len(fields) == 2 {
		_ = exec.Command("ipcrm", "-m", fields[1]).Run()
	}
	return nil
}

func childrenOf(process int) ([]int, error) {
	content, err := os.ReadFile(fmt.Sprintf("/proc/%d/task/%d/children", process, process))
	if err != nil {
		return nil, err
	}
	var children []int
	for _, field := range strings.Fields(string(content)) {
		child, err := strconv.Atoi(field)
		if err != nil {
			return nil, err
		}
		children = append(children, child)
	}
	return children, nil
}
