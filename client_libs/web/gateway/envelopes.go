package main

import "encoding/binary"

// envelopes follows the messages of a body in the format of gRPC, of which it sees one part after the other.
// The zero value is ready for a body.
type envelopes struct {
	// The bytes of a prefix that has come in part.
	prefix []byte
	// The bytes of the message that are still to come.
	rest int64
}

// follow goes on with the next part. It calls begun with the length of each message whose prefix ends in it.
func (e *envelopes) follow(part []byte, begun func(length int64)) {
	for len(part) > 0 {
		if e.rest > 0 {
			n := min(e.rest, int64(len(part)))
			e.rest -= n
			part = part[n:]
			continue
		}
		n := min(prefixBytes-len(e.prefix), len(part))
		e.prefix = append(e.prefix, part[:n]...)
		part = part[n:]
		if len(e.prefix) == prefixBytes {
			e.rest = int64(binary.BigEndian.Uint32(e.prefix[1:]))
			e.prefix = e.prefix[:0]
			begun(e.rest)
		}
	}
}

// isBetween reports whether no message has come in part.
func (e *envelopes) isBetween() bool { return e.rest == 0 && len(e.prefix) == 0 }
