package postgres

import (
	"net"
	"sync"
)

// Direction is a direction of a link.
type Direction int

// Requests go to the database, answers come from it.
const (
	Requests Direction = iota
	Answers
	directions
)

// Link passes the bytes of TCP connections to a node of the database on, and can be cut in each
// direction. While it is cut, nothing arrives, not even the end of a connection, and nobody is told: as in
// a network that loses all packets. What was sent meanwhile arrives when the cut ends, as TCP sends it
// again, unless the connections are lost. Thread safe.
type Link struct {
	listener net.Listener
	target   string

	mutex       sync.Mutex
	isOpen      *sync.Cond
	isCut       [directions]bool
	isClosed    bool
	connections map[*connection]struct{}
}

// connection is one connection through a link.
type connection struct {
	ends    []net.Conn
	isEnded bool
}

// NewLink starts to take connections for an address.
func NewLink(target string) (*Link, error) {
	listener, err := net.Listen("tcp", "127.0.0.1:0")
	if err != nil {
		return nil, err
	}
	l := &Link{listener: listener, target: target, connections: map[*connection]struct{}{}}
	l.isOpen = sync.NewCond(&l.mutex)
	go l.accept()
	return l, nil
}

// Address is where the link takes connections.
func (l *Link) Address() string { return l.listener.Addr().String() }

// Cut keeps all bytes of a direction back until Mend.
func (l *Link) Cut(direction Direction) {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	l.isCut[direction] = true
}

// Mend ends all cuts. If the connections are kept, what was sent arrives now; otherwise they end.
func (l *Link) Mend(keepConnections bool) {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	l.isCut = [directions]bool{}
	if !keepConnections {
		l.endAll()
	}
	l.isOpen.Broadcast()
}

// Close ends all connections, and takes no more.
func (l *Link) Close() {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	l.isClosed = true
	_ = l.listener.Close()
	l.endAll()
	l.isOpen.Broadcast()
}

// REQUIRES: the mutex is held.
func (l *Link) endAll() {
	for c := range l.connections {
		l.end(c)
	}
}

// end ends a connection. REQUIRES: the mutex is held.
func (l *Link) end(c *connection) {
	c.isEnded = true
	for _, end := range c.ends {
		_ = end.Close()
	}
	delete(l.connections, c)
}

func (l *Link) accept() {
	for {
		client, err := l.listener.Accept()
		if err != nil {
			return // It was closed.
		}
		go l.serve(client)
	}
}

// serve passes the bytes of a connection on until it ends.
func (l *Link) serve(client net.Conn) {
	c := &connection{}
	defer l.leave(c)
	// The packets that open a connection are lost as others are.
	if !l.add(c, client) || !l.pass(c, Requests) {
		return
	}
	server, err := net.Dial("tcp", l.target)
	if err != nil || !l.add(c, server) {
		return
	}
	ended := make(chan struct{})
	go func() {
		defer close(ended)
		l.copy(c, Answers, client, server)
	}()
	l.copy(c, Requests, server, client)
	<-ended
}

// add gives a connection one of its ends, and reports whether it goes on.
func (l *Link) add(c *connection, end net.Conn) bool {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	if c.isEnded || l.isClosed {
		_ = end.Close()
		return false
	}
	c.ends = append(c.ends, end)
	l.connections[c] = struct{}{}
	return true
}

func (l *Link) leave(c *connection) {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	l.end(c)
}

// copy passes one direction of a connection on, and then ends the connection.
func (l *Link) copy(c *connection, direction Direction, to, from net.Conn) {
	defer l.leave(c)
	buffer := make([]byte, 32<<10)
	for {
		count, readErr := from.Read(buffer)
		if !l.pass(c, direction) {
			return
		}
		if _, err := to.Write(buffer[:count]); err != nil || readErr != nil {
			return
		}
	}
}

// pass returns true when the direction is not cut, and false if the connection has ended.
func (l *Link) pass(c *connection, direction Direction) bool {
	l.mutex.Lock()
	defer l.mutex.Unlock()
	for l.isCut[direction] && !c.isEnded {
		l.isOpen.Wait()
	}
	return !c.isEnded
}
