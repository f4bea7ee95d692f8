package main

import (
	"log"
	"net"
	"sync"
	"syscall"
	"time"
)

// spareDescriptors is the number of file descriptors that are kept for files, the server and standard
// streams.
const spareDescriptors = 64

// boundedListener closes connections above a quota as soon as they are accepted.
type boundedListener struct {
	*net.TCPListener
	connections *quota
	full        occasionalLog
}

// boundConnections bounds the connections that the listener returns.
func boundConnections(listener *net.TCPListener, limits limits) *boundedListener {
	total := limits.maxConnections
	var descriptors syscall.Rlimit
	// The Go runtime has raised the soft limit to the hard one.
	if syscall.Getrlimit(syscall.RLIMIT_NOFILE, &descriptors) == nil {
		if most := connectionsWithin(descriptors.Cur); most < total {
			log.Printf("takes %d connections instead of --max_connections=%d: only %d files may be open (ulimit -n)",
				most, total, descriptors.Cur)
			total = most
		}
	}
	return &boundedListener{
		TCPListener: listener,
		connections: newQuota(total, limits.addressShare),
	}
}

// connectionsWithin returns the number of connections for which the file descriptors suffice.
func connectionsWithin(descriptors uint64) int64 {
	const most = 1 << 31
	if descriptors >= most {
		return most
	}
	return max(int64(descriptors)-spareDescriptors, int64(descriptors)/4, 1)
}

func (l *boundedListener) Accept() (net.Conn, error) {
	for {
		conn, err := l.AcceptTCP()
		if err != nil {
			return nil, err
		}
		address := addressOf(conn.RemoteAddr().String())
		if l.connections.take(address, 1) {
			return &countedConn{
				TCPConn: conn,
				release: sync.OnceFunc(func() { l.connections.release(address, 1) }),
			}, nil
		}
		_ = conn.Close()
		l.full.count("connections were closed at once, the latest from %s: the limit is %d in total and %d for an address "+
			"(--max_connections, --address_share)", address, l.connections.total, l.connections.share)
	}
}

// countedConn leaves its quota when it is closed.
type countedConn struct {
	*net.TCPConn
	release func()
}

func (c *countedConn) Close() error {
	defer c.release()
	return c.TCPConn.Close()
}

// occasionalLog logs an event that may be frequent at most once a minute, with its number.
type occasionalLog struct {
	mu     sync.Mutex
	logged time.Time
	events int
}

func (o *occasionalLog) count(format string, arguments ...any) {
	o.mu.Lock()
	defer o.mu.Unlock()
	o.events++
	if time.Since(o.logged) < time.Minute {
		return
	}
	log.Printf("%d "+format, append([]any{o.events}, arguments...)...)
	o.logged = time.Now()
	o.events = 0
}
