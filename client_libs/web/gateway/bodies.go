package main

import (
	"bytes"
	"compress/flate"
	"compress/gzip"
	"context"
	"encoding/binary"
	"errors"
	"fmt"
	"io"
	"net/http"
	"net/netip"
	"os"
	"sync"
	"sync/atomic"
	"time"

	"connectrpc.com/connect"
)

const (
	// copiesOfMessage is the number of times that a message is in memory while it is read and forwarded:
	// a buffer that grows by doubling, and a copy.
	copiesOfMessage = 4
	// copiesUnpacked is the same for a compressed message of a stream, which is unpacked before that.
	copiesUnpacked = 3
	// unpackerBytes is the memory of an unpacker of gzip.
	unpackerBytes = 64 << 10
)

// requestBody is the body of a call. It unpacks gzip, takes memory for what it returns before it returns
// it, and fails if the body is too large or too slow.
//
// Read is for one goroutine; the other functions and isWhole may be used by others.
type requestBody struct {
	io.Reader // From the connection, over timedReader and one of the readers of messages.

	limits  *limits
	memory  *quota
	address netip.Addr
	isJSON  bool
	control *http.ResponseController
	isWhole atomic.Bool // whether Read has returned the end of what was sent

	mu    sync.Mutex
	taken int64
	// Memory for the message of the answer that is being forwarded.
	answer  int64
	ended   bool
	refused *refusal
}

// refusal is the reason why a body is not read further.
type refusal struct {
	status  int
	failure *connect.Error
}

// bodyKind says how the body of a request is to be read.
type bodyKind struct {
	isJSON bool
	// Whether the body has messages with prefixes.
	isStream bool
	isPacked bool
	// Whether the client may send more than one message, and wait between them.
	isUpload bool
	// Whether the client may wait for answers between its messages.
	isDialogue bool
}

func newRequestBody(w http.ResponseWriter, r *http.Request, kind bodyKind, limits *limits, memory *quota) *requestBody {
	b := &requestBody{
		limits:  limits,
		memory:  memory,
		address: addressOf(r.RemoteAddr),
		isJSON:  kind.isJSON,
		control: http.NewResponseController(w),
	}
	if r.ContentLength == 0 {
		b.isWhole.Store(true)
		b.Reader = http.NoBody // A deadline would end a call that has nothing to read.
		return b
	}
	timed := &timedReader{source: r.Body, setDeadline: b.setDeadline, limits: limits, isWhole: &b.isWhole}
	timed.start()
	if kind.isStream {
		b.Reader = &streamReader{body: b, source: timed, kind: kind}
	} else {
		b.Reader = &messageReader{body: b, source: timed, isPacked: kind.isPacked, declared: r.ContentLength}
	}
	return b
}

// Close leaves the rest of the body to the HTTP server, which answers before it reads it.
func (b *requestBody) Close() error { return nil }

// take takes memory for the body.
func (b *requestBody) take(amount int64) error {
	return b.charge(&b.taken, amount, func() error {
		if b.taken+amount > b.memory.share {
			return b.refuseLocked(http.StatusRequestEntityTooLarge, connect.CodeResourceExhausted, b.neverFits())
		}
		return b.refuseLocked(http.StatusServiceUnavailable, connect.CodeResourceExhausted, fmt.Sprintf(
			"other calls have taken the memory for bodies: %d bytes, %d for an address (--max_total_body_bytes, --address_share)",
			b.memory.total, b.memory.share))
	})
}

// takeForAnswer takes memory for a message of the answer.
func (b *requestBody) takeForAnswer(amount int64) error {
	return b.charge(&b.answer, amount, func() error {
		return b.refuseLocked(http.StatusServiceUnavailable, connect.CodeResourceExhausted, fmt.Sprintf(
			"there is no memory for the answer, which takes %d bytes: all calls may have %d, and an address %d (--max_total_body_bytes, --address_share)",
			b.answer+amount, b.memory.total, b.memory.share))
	})
}

// charge takes memory and adds it to `held`, or returns what `refuse` returns, which is called with b.mu held.
func (b *requestBody) charge(held *int64, amount int64, refuse func() error) error {
	b.mu.Lock()
	defer b.mu.Unlock()
	if b.ended {
		return errEnded
	}
	if !b.memory.take(b.address, amount) {
		return refuse()
	}
	*held += amount
	return nil
}

// release gives back the memory of the body's messages that were forwarded.
func (b *requestBody) release() {
	b.mu.Lock()
	defer b.mu.Unlock()
	b.giveBackLocked(&b.taken)
}

// releaseAnswer gives back the memory of an answer's message that was sent.
func (b *requestBody) releaseAnswer() {
	b.mu.Lock()
	defer b.mu.Unlock()
	b.giveBackLocked(&b.answer)
}

// end gives back all memory, and takes no more.
func (b *requestBody) end() {
	b.mu.Lock()
	defer b.mu.Unlock()
	b.giveBackLocked(&b.taken)
	b.giveBackLocked(&b.answer)
	b.ended = true
}

// giveBackLocked gives back what is held. REQUIRES: b.mu is held.
func (b *requestBody) giveBackLocked(held *int64) {
	b.memory.release(b.address, *held)
	*held = 0
}

// setDeadline sets the deadline of the connection. After the end of a call it must not be set any more.
func (b *requestBody) setDeadline(deadline time.Time) error {
	b.mu.Lock()
	defer b.mu.Unlock()
	if b.ended {
		return errEnded
	}
	// A connection without deadlines is one of a test.
	_ = b.control.SetReadDeadline(deadline)
	return nil
}

var errEnded = connect.NewError(connect.CodeCanceled, errors.New("the call has ended"))

// refuseLocked returns an error for the client and remembers it. REQUIRES: b.mu is held.
func (b *requestBody) refuseLocked(status int, code connect.Code, message string) error {
	b.refused = &refusal{status, connect.NewError(code, errors.New(message))}
	return b.refused.failure
}

func (b *requestBody) refuse(status int, code connect.Code, message string) error {
	b.mu.Lock()
	defer b.mu.Unlock()
	return b.refuseLocked(status, code, message)
}

// mostBytes returns how large a message may be in the format in which it is sent.
func (b *requestBody) mostBytes() int64 {
	if b.isJSON {
		return b.limits.maxBodyBytes // The encoded message is smaller, and is checked before it is forwarded.
	}
	return min(b.limits.maxBodyBytes, b.limits.maxMessageBytes)
}

func (b *requestBody) refuseLarge() error {
	if b.mostBytes() < b.limits.maxBodyBytes {
		return b.refuseLargeMessage()
	}
	return b.refuse(http.StatusRequestEntityTooLarge, connect.CodeResourceExhausted,
		fmt.Sprintf("a body, or a message of a stream, may have %d bytes unpacked (--max_body_bytes)", b.limits.maxBodyBytes))
}

// checkMessage refuses a message that the server would not accept.
func (b *requestBody) checkMessage(request *message) error {
	if int64(len(request.binary)) > b.limits.maxMessageBytes {
		return b.refuseLargeMessage()
	}
	return nil
}

func (b *requestBody) refuseLargeMessage() error {
	return b.refuse(http.StatusRequestEntityTooLarge, connect.CodeResourceExhausted,
		fmt.Sprintf("a message may have %d bytes encoded as Protobuf (--max_message_bytes of the gateway)", b.limits.maxMessageBytes))
}

// refuseForever refuses a body that is larger than the memory which one address may ever have.
func (b *requestBody) refuseForever() error {
	return b.refuse(http.StatusRequestEntityTooLarge, connect.CodeResourceExhausted, b.neverFits())
}

func (b *requestBody) neverFits() string {
	return fmt.Sprintf(
		"the body takes more memory than the %d bytes that an address may have (--max_total_body_bytes, --address_share)",
		b.memory.share)
}

// explain turns an error of the connection into one for the client.
func (b *requestBody) explain(err error) error {
	if !errors.Is(err, os.ErrDeadlineExceeded) {
		return err
	}
	return b.refuse(http.StatusRequestTimeout, connect.CodeDeadlineExceeded, fmt.Sprintf(
		"the body arrives too slowly: it may take %v, and a second for each %d bytes", b.limits.patience, b.limits.bytesPerSecond))
}

// refusal returns why the body was refused, or nil.
func (b *requestBody) refusal() *refusal {
	b.mu.Lock()
	defer b.mu.Unlock()
	return b.refused
}

type bodyKey struct{}

func withBody(ctx context.Context, body *requestBody) context.Context {
	return context.WithValue(ctx, bodyKey{}, body)
}

// bodyOf returns the body of the call.
func bodyOf(ctx context.Context) *requestBody { return ctx.Value(bodyKey{}).(*requestBody) }

// timedReader reads from a connection. What is read since start must arrive within limits.timeFor.
type timedReader struct {
	source      io.Reader
	setDeadline func(time.Time) error
	limits      *limits
	isWhole     *atomic.Bool

	started  time.Time
	received int64
	deadline time.Time
	ended    error
}

// start starts the time of a message.
func (t *timedReader) start() { t.started, t.received = time.Now(), 0 }

func (t *timedReader) Read(data []byte) (int, error) {
	return t.readUntil(t.started.Add(t.limits.timeFor(t.received)), data)
}

// readUntil reads before the deadline, or without one if it is zero.
func (t *timedReader) readUntil(deadline time.Time, data []byte) (int, error) {
	if t.ended != nil {
		return 0, t.ended // A deadline after the end of the body would end the call.
	}
	if !deadline.Equal(t.deadline) {
		if err := t.setDeadline(deadline); err != nil {
			return 0, err
		}
		t.deadline = deadline
	}
	n, err := t.source.Read(data)
	t.received += int64(n)
	t.ended = err
	if errors.Is(err, io.EOF) {
		t.isWhole.Store(true)
	}
	return n, err
}

// messageReader reads a body that is a message.
type messageReader struct {
	body     *requestBody
	source   io.Reader
	isPacked bool
	// The length of the body as sent, or -1.
	declared int64
	returned int64
	scanner  jsonScanner
}

func (m *messageReader) Read(data []byte) (int, error) {
	if m.returned == 0 && m.declared > m.body.mostBytes() {
		return 0, m.body.refuseLarge()
	}
	if m.returned == 0 && m.declared*copiesOfMessage > m.body.memory.share {
		return 0, m.body.refuseForever()
	}
	if m.isPacked {
		m.isPacked = false
		unpacked, err := m.body.unpack(m.source)
		if err != nil {
			return 0, err
		}
		m.source = unpacked
	}
	n, err := m.source.Read(data)
	m.returned += int64(n)
	if m.returned > m.body.mostBytes() {
		return 0, m.body.refuseLarge()
	}
	if failure := m.body.takeFor(data[:n], copiesOfMessage, &m.scanner); failure != nil {
		return 0, failure
	}
	return n, m.body.explain(err)
}

// takeFor takes memory for a part of a message.
func (b *requestBody) takeFor(data []byte, copies int64, scanner *jsonScanner) error {
	amount := copies * int64(len(data))
	if b.isJSON {
		amount += scanner.parsedBytes(data)
	}
	return b.take(amount)
}

// unpack returns a reader of what is packed with gzip.
func (b *requestBody) unpack(packed io.Reader) (io.Reader, error) {
	if err := b.take(unpackerBytes); err != nil {
		return nil, err
	}
	unpacker, err := gzip.NewReader(packed)
	if err != nil {
		return nil, b.explain(notGzip(err))
	}
	return unpackedReader{unpacker}, nil
}

// notGzip turns an error of the format into one for the client.
func notGzip(err error) error {
	var corrupt flate.CorruptInputError
	if errors.As(err, &corrupt) || errors.Is(err, gzip.ErrHeader) || errors.Is(err, gzip.ErrChecksum) ||
		errors.Is(err, io.EOF) || errors.Is(err, io.ErrUnexpectedEOF) {
		return connect.NewError(connect.CodeInvalidArgument, fmt.Errorf("the body is not gzip: %v", err))
	}
	return err
}

// unpackedReader returns errors of gzip as errors for the client.
type unpackedReader struct{ *gzip.Reader }

func (u unpackedReader) Read(data []byte) (int, error) {
	n, err := u.Reader.Read(data)
	if err == io.EOF {
		return n, err // The end of what is packed, after its checksum was found right.
	}
	return n, notGzip(err)
}

const (
	prefixBytes    = 5
	compressedFlag = 1
)

// streamReader reads a body of messages, each of which has a prefix: a byte of flags, and the length in
// four bytes. It returns packed messages unpacked.
type streamReader struct {
	body   *requestBody
	source *timedReader
	kind   bodyKind

	// A prefix, and possibly the message, of which nothing was returned yet.
	ready []byte
	// The number of bytes of the message that are still to be read from source.
	rest     int64
	received bool // whether there was a message
	scanner  jsonScanner
}

func (s *streamReader) Read(data []byte) (int, error) {
	if len(s.ready) == 0 && s.rest == 0 {
		if err := s.next(); err != nil {
			return 0, s.body.explain(err)
		}
	}
	if len(s.ready) > 0 {
		n := copy(data, s.ready)
		s.ready = s.ready[n:]
		return n, nil
	}
	n, err := s.source.Read(data[:min(int64(len(data)), s.rest)])
	s.rest -= int64(n)
	if failure := s.body.takeFor(data[:n], copiesOfMessage, &s.scanner); failure != nil {
		return 0, failure
	}
	return n, s.body.explain(err)
}

// next reads the prefix of a message, and the message if it is packed.
func (s *streamReader) next() error {
	prefix := make([]byte, prefixBytes)
	if err := s.wait(prefix[:1]); err != nil {
		return err
	}
	s.source.start()
	if _, err := io.ReadFull(s.source, prefix[1:]); err != nil {
		return unexpected(err)
	}
	s.received = true
	s.scanner = jsonScanner{}
	length := int64(binary.BigEndian.Uint32(prefix[1:]))
	if length > s.body.mostBytes() {
		return s.body.refuseLarge()
	}
	if !s.kind.isPacked || prefix[0]&compressedFlag == 0 || length == 0 {
		s.ready, s.rest = prefix, length
		return nil
	}
	return s.unpack(prefix, length)
}

// wait reads the first byte of a message, or returns io.EOF. The first message must arrive in time. Before
// a later one an upload may pause, and a dialogue may rest for as long as the client likes.
func (s *streamReader) wait(first []byte) error {
	deadline := s.source.started.Add(s.body.limits.timeFor(s.source.received))
	switch {
	case s.kind.isDialogue:
		deadline = time.Time{}
	case s.kind.isUpload && s.received:
		deadline = time.Now().Add(s.body.limits.idleTime)
	}
	for {
		n, err := s.source.readUntil(deadline, first)
		if n > 0 {
			return nil
		}
		if err != nil {
			return err
		}
	}
}

// unpack reads a packed message of the length.
func (s *streamReader) unpack(prefix []byte, length int64) error {
	packed := io.LimitReader(s.source, length)
	unpacked, err := s.body.unpack(packed)
	if err != nil {
		return err
	}
	message := bytes.NewBuffer(prefix)
	part := make([]byte, 32<<10)
	for {
		n, err := unpacked.Read(part)
		if int64(message.Len()+n) > prefixBytes+s.body.mostBytes() {
			return s.body.refuseLarge()
		}
		if failure := s.body.takeFor(part[:n], copiesOfMessage+copiesUnpacked, &s.scanner); failure != nil {
			return failure
		}
		message.Write(part[:n])
		if errors.Is(err, io.EOF) {
			break
		}
		if err != nil {
			return err
		}
	}
	if _, err := io.Copy(io.Discard, packed); err != nil {
		return err
	}
	s.ready = message.Bytes()
	s.ready[0] &^= compressedFlag
	binary.BigEndian.PutUint32(s.ready[1:prefixBytes], uint32(message.Len()-prefixBytes))
	return nil
}

func unexpected(err error) error {
	if errors.Is(err, io.EOF) {
		return io.ErrUnexpectedEOF
	}
	return err
}
