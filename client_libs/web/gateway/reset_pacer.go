package main

import (
	"net/netip"
	"slices"
	"sync"
	"time"
)

const (
	// resetsPerSecond is how many calls to the server are cancelled in a second. All browsers share one
	// connection, and hypermapd shuts down a connection of which it cancels 1,000 calls in a second, or finds
	// 12 or more RST_STREAM frames unread four times in a second (base/admission).
	resetsPerSecond = 50
	// resetBurst is how many of them may come at once.
	resetBurst = 4
)

// resetPacer lets calls to the server be cancelled one after the other. Addresses take turns, so that the
// calls of one do not wait for all of another. Safe for concurrent use.
type resetPacer struct {
	mu     sync.Mutex
	tokens float64
	filled time.Time
	// Whether a timer will give the next turn.
	isTimed bool
	// Whether calls wait no longer.
	isStopped bool
	// Calls that wait for their turn: channels that are closed when it comes.
	byAddress map[netip.Addr][]chan struct{}
	// The addresses that have such calls, in the order of their turns.
	order []netip.Addr
}

func newResetPacer() *resetPacer {
	return &resetPacer{tokens: resetBurst, filled: time.Now(), byAddress: map[netip.Addr][]chan struct{}{}}
}

// wait waits until a call of the address may be cancelled, or has ended by itself. It returns whether the
// call may be cancelled.
func (p *resetPacer) wait(address netip.Addr, ended <-chan struct{}) bool {
	select {
	case <-ended:
		return false
	default:
	}
	turn := make(chan struct{})
	p.mu.Lock()
	if len(p.byAddress[address]) == 0 {
		p.order = append(p.order, address)
	}
	p.byAddress[address] = append(p.byAddress[address], turn)
	p.giveTurnsLocked()
	p.mu.Unlock()
	select {
	case <-turn:
		return true
	case <-ended:
		p.leave(address, turn)
		return false
	}
}

// stop lets all calls be cancelled at once, because the connection to the server is about to be closed.
func (p *resetPacer) stop() {
	p.mu.Lock()
	defer p.mu.Unlock()
	p.isStopped = true
	p.giveTurnsLocked()
}

// waiting returns how many calls of the address wait for their turn.
func (p *resetPacer) waiting(address netip.Addr) int64 {
	p.mu.Lock()
	defer p.mu.Unlock()
	return int64(len(p.byAddress[address]))
}

// leave removes a call that waits no longer.
func (p *resetPacer) leave(address netip.Addr, turn chan struct{}) {
	p.mu.Lock()
	defer p.mu.Unlock()
	if i := slices.Index(p.byAddress[address], turn); i >= 0 {
		p.removeLocked(address, i)
	}
}

// removeLocked removes one of the calls of an address. REQUIRES: p.mu is held.
func (p *resetPacer) removeLocked(address netip.Addr, i int) {
	p.byAddress[address] = slices.Delete(p.byAddress[address], i, i+1)
	if len(p.byAddress[address]) > 0 {
		return
	}
	delete(p.byAddress, address)
	p.order = slices.DeleteFunc(p.order, func(other netip.Addr) bool { return other == address })
}

// giveTurnsLocked gives the turns that are due. REQUIRES: p.mu is held.
func (p *resetPacer) giveTurnsLocked() {
	now := time.Now()
	p.tokens = min(p.tokens+now.Sub(p.filled).Seconds()*resetsPerSecond, resetBurst)
	p.filled = now
	for (p.tokens >= 1 || p.isStopped) && len(p.order) > 0 {
		p.tokens--
		address := p.order[0]
		close(p.byAddress[address][0])
		p.order = append(p.order[1:], address)
		p.removeLocked(address, 0)
	}
	if len(p.order) == 0 || p.isTimed {
		return
	}
	p.isTimed = true
	time.AfterFunc(time.Second/resetsPerSecond, func() {
		p.mu.Lock()
		defer p.mu.Unlock()
		p.isTimed = false
		p.giveTurnsLocked()
	})
}
