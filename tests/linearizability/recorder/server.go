package recorder

import (
	"bufio"
	"context"
	"fmt"
	"os"
	"os/exec"
	"strings"
	"sync"
	"sync/atomic"
	"syscall"
	"time"
)

// startDeadline is longer than a server takes to start on a busy machine.
const startDeadline = 60 * time.Second

// server is a hypermapd process that can be killed and started again on the same data folder.
type server struct {
	program string
	dataDir string
	logFile string
	// flags are further arguments, which may be changed while the server is down.
	flags []string
	// onDeath is called if a process ends in another way than by kill.
	onDeath func(error)

	mutex   sync.Mutex
	process *process // nil while the server is down
	address string
	// up is closed while the server runs.
	up chan struct{}
}

// process is one run of the server.
type process struct {
	*exec.Cmd
	killed atomic.Bool
	ended  chan struct{}
}

func newServer(program, dataDir, logFile string, onDeath func(error)) *server {
	return &server{program: program, dataDir: dataDir, logFile: logFile, onDeath: onDeath, up: make(chan struct{})}
}

// start starts the server on a free port, and returns when it takes calls.
func (s *server) start() error {
	log, err := os.OpenFile(s.logFile, os.O_CREATE|os.O_APPEND|os.O_WRONLY, 0o644)
	if err != nil {
		return err
	}
	defer log.Close()
	// Answers with more than two objects come in several messages.
	flags := append([]string{"--data_dir=" + s.dataDir, "--listen=127.0.0.1:0", "--chunk_items=2"}, s.flags...)
	command := exec.Command(s.program, flags...)
	command.Stderr = log
	// The server does not outlive this program.
	command.SysProcAttr = &syscall.SysProcAttr{Pdeathsig: syscall.SIGKILL}
	output, err := command.StdoutPipe()
	if err != nil {
		return err
	}
	if err := command.Start(); err != nil {
		return err
	}
	tooLate := time.AfterFunc(startDeadline, func() { _ = command.Process.Kill() })
	defer tooLate.Stop()
	lines := bufio.NewScanner(output)
	for lines.Scan() {
		if address, ready := strings.CutPrefix(lines.Text(), "hypermapd ready on "); ready {
			s.run(&process{Cmd: command, ended: make(chan struct{})}, address)
			return nil
		}
	}
	_ = command.Process.Kill()
	return fmt.Errorf("the server did not start: %w", command.Wait())
}

func (s *server) run(p *process, address string) {
	s.mutex.Lock()
	defer s.mutex.Unlock()
	s.process, s.address = p, address
	close(s.up)
	go s.await(p)
}

// await waits for the end of a process, and tells if it was not killed.
func (s *server) await(p *process) {
	err := p.Wait()
	status, ok := p.ProcessState.Sys().(syscall.WaitStatus)
	if !p.killed.Load() || !ok || status.Signal() != syscall.SIGKILL {
		s.onDeath(fmt.Errorf("the server ended by itself: %v", err))
	}
	close(p.ended)
}

// kill kills the server with SIGKILL, and returns when it has ended.
func (s *server) kill() {
	s.mutex.Lock()
	p := s.process
	s.process = nil
	if p != nil {
		s.up = make(chan struct{})
	}
	s.mutex.Unlock()
	if p != nil {
		p.killed.Store(true)
		_ = p.Process.Kill()
		<-p.ended
	}
}

// freeze stops the process with SIGSTOP until thaw. REQUIRES: the server runs.
func (s *server) freeze() error { return s.signal(syscall.SIGSTOP) }
func (s *server) thaw() error   { return s.signal(syscall.SIGCONT) }

func (s *server) signal(signal syscall.Signal) error {
	s.mutex.Lock()
	defer s.mutex.Unlock()
	return s.process.Process.Signal(signal)
}

// isUp reports whether the server runs or is frozen.
func (s *server) isUp() bool {
	s.mutex.Lock()
	defer s.mutex.Unlock()
	return s.process != nil
}

// currentAddress returns the address of the server, or its last one while it is down.
func (s *server) currentAddress() string {
	s.mutex.Lock()
	defer s.mutex.Unlock()
	return s.address
}

// awaitUp returns when the server runs.
func (s *server) awaitUp(ctx context.Context) error {
	s.mutex.Lock()
	up := s.up
	s.mutex.Unlock()
	select {
	case <-up:
		return nil
	case <-ctx.Done():
		return ctx.Err()
	}
}
