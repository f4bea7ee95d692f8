"""HTTP/2 connections whose frames are written by hand, for what no gRPC library would send.

Frames are those of RFC 9113, header fields those of RFC 7541. Header fields are sent as literals
without indexing; in answers, only the trailers of gRPC 1.51 are understood, which it does not
compress with Huffman's code.
"""

import select
import socket
import struct
import time

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"

DATA, HEADERS, PRIORITY, RST_STREAM, SETTINGS, PING, GOAWAY = 0, 1, 2, 3, 4, 6, 7
WINDOW_UPDATE, CONTINUATION = 8, 9
END_STREAM, ACK, END_HEADERS = 1, 1, 4
CANCEL = 8
INITIAL_WINDOW_SIZE, MAX_FRAME_SIZE = 4, 5

# The address of attackers that fill what one address may have. The other clients, who come from
# 127.0.0.1, have a share of their own.
ATTACKER = "127.0.0.2"
SECOND_ATTACKER = "127.0.0.3"

# The most bytes of a write.
_MAX_WRITE = 16_384

# Entries of the table in RFC 7541, appendix A. gRPC's own fields are not among them.
_STATIC_TABLE_SIZE = 61


class Closed(Exception):
    """The server has closed the connection, or does not answer in time."""


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">IBI", len(payload) << 8 | kind, flags, stream) + payload


def setting(identifier, value):
    return struct.pack(">HI", identifier, value)


def _integer(value, prefix_bits, first=0):
    limit = (1 << prefix_bits) - 1
    if value < limit:
        return bytes([first | value])
    encoded, value = bytearray([first | limit]), value - limit
    while value >= 128:
        encoded.append(value & 127 | 128)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def string(text):
    """Returns a string as it is in a header block."""
    return _integer(len(text), 7) + text


def indexed(number):
    """Returns a reference to a field of the dynamic table, as in a header block. 0 is the field
    that was added last."""
    return _integer(_STATIC_TABLE_SIZE + 1 + number, 7, 0x80)


def literal_begin(name, size):
    """Returns the begin of a field in a header block, whose value has `size` bytes."""
    return b"\0" + string(name) + _integer(size, 7)


def header_block(fields):
    """Returns the header block of (name, value) pairs of bytes."""
    block = bytearray()
    for name, value in fields:
        block += b"\0" + string(name) + string(value)
    return bytes(block)


def grpc_headers(method, *more):
    """Returns the header block of a gRPC call, for example of "QueryService/QueryArea"."""
    return header_block([
        (b":method", b"POST"), (b":scheme", b"http"),
        (b":path", f"/hypermap.v1.{method}".encode()), (b":authority", b"localhost"),
        (b"te", b"trailers"), (b"content-type", b"application/grpc"), *more])


def grpc_message(message, compressed=False):
    """Returns the body of a call with one message."""
    return struct.pack(">BI", compressed, len(message)) + message


class _HeaderReader:
    """Decodes the header blocks of one connection."""

    def __init__(self):
        self._dynamic = []

    def decode(self, block):
        """Returns the fields of a block whose names were not taken from the static table."""
        fields, at = {}, 0
        while at < len(block):
            first = block[at]
            if first & 0x80:
                index, at = self._read_integer(block, at, 7)
                name, value = self._entry(index)
            elif first & 0xe0 == 0x20:
                _, at = self._read_integer(block, at, 5)  # a new size of the table
                continue
            else:
                indexed = bool(first & 0x40)
                index, at = self._read_integer(block, at, 6 if indexed else 4)
                name = self._entry(index)[0] if index else None
                if name is None:
                    name, at = self._read_string(block, at)
                value, at = self._read_string(block, at)
                if indexed:
                    self._dynamic.insert(0, (name, value))
            fields[name] = value
        return fields

    def _entry(self, index):
        if index <= _STATIC_TABLE_SIZE:
            return b"static", b""
        return self._dynamic[index - _STATIC_TABLE_SIZE - 1]

    @staticmethod
    def _read_integer(block, at, prefix_bits):
        limit = (1 << prefix_bits) - 1
        value, at = block[at] & limit, at + 1
        if value < limit:
            return value, at
        shift = 0
        while True:
            byte, at = block[at], at + 1
            value += (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value, at

    def _read_string(self, block, at):
        size, end = self._read_integer(block, at, 7)
        return block[end:end + size], end + size


class Connection:
    """A connection to the server. With `source`, it comes from that address of this machine, such
    as 127.0.0.2; `window` is the number of bytes that each stream may receive unread."""

    def __init__(self, address, source=None, window=65535, timeout_s=10):
        host, port = address.rsplit(":", 1)
        self._timeout_s = timeout_s
        self._socket = socket.create_connection((host, int(port)), timeout=timeout_s,
                                                source_address=(source, 0) if source else None)
        self._received = b""
        self._headers = _HeaderReader()
        self._send_windows = {0: 65535}
        self._stream_window = 65535
        self._max_frame = 16384
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._next_stream = 1
        # Header fields of answers by stream, and streams that the server has ended or reset.
        self.fields = {}
        self.ended = set()
        self.send(PREFACE + frame(SETTINGS, 0, 0, setting(INITIAL_WINDOW_SIZE, window)))

    def send(self, data):
        try:
            # In parts: while the system copies a large one, nobody else gets the processor.
            for begin in range(0, len(data), _MAX_WRITE):
                self._socket.sendall(data[begin:begin + _MAX_WRITE])
        except OSError as error:
            raise Closed(str(error)) from error

    def new_stream(self):
        stream, self._next_stream = self._next_stream, self._next_stream + 2
        return stream

    def connection_window(self):
        """Returns the number of bytes of DATA that the server still takes on all streams."""
        return self._send_windows[0]

    def count_sent(self, size):
        """Counts bytes of DATA that were written with send()."""
        self._send_windows[0] -= size

    def send_data(self, stream, data, end=True):
        """Sends the body of a stream as fast as the server takes it. Returns whether it took all:
        it may end the stream before."""
        deadline, sent = time.monotonic() + self._timeout_s, 0
        self._send_windows[stream] = self._stream_window
        while sent < len(data):
            size = min(len(data) - sent, self._max_frame, self._send_windows[0],
                       self._send_windows[stream])
            if stream in self.ended:
                return False
            if size <= 0:
                self.receive(max(deadline - time.monotonic(), 0.001))
                continue
            last = end and sent + size == len(data)
            self.send(frame(DATA, END_STREAM if last else 0, stream, data[sent:sent + size]))
            self._send_windows[0] -= size
            self._send_windows[stream] -= size
            sent += size
            self.receive(0)
        return True

    def call(self, headers, body):
        """Makes a call with one message. Returns (status code, message) of gRPC."""
        stream = self.new_stream()
        self.send(frame(HEADERS, END_HEADERS, stream, headers))
        self.send_data(stream, body)
        return self.status(stream)

    def status(self, stream):
        """Waits for the end of a stream. Returns (status code, message); the code is None if the
        server has reset the stream."""
        deadline = time.monotonic() + self._timeout_s
        while stream not in self.ended:
            self.receive(max(deadline - time.monotonic(), 0.001))
        fields = self.fields.get(stream, {})
        code = fields.get(b"grpc-status")
        return (int(code) if code else None,
                fields.get(b"grpc-message", b"").decode(errors="replace"))

    def receive(self, timeout_s):
        """Reads what has come, waiting for it at most `timeout_s` if that is positive."""
        if not self._poll.poll(max(timeout_s, 0) * 1000):
            if timeout_s > 0:
                raise Closed("no answer")
            return
        try:
            data = self._socket.recv(1 << 18)
        except OSError as error:
            raise Closed(str(error)) from error
        if not data:
            raise Closed("closed by the server")
        self._received += data
        while len(self._received) >= 9:
            size = int.from_bytes(self._received[:3], "big")
            if len(self._received) < 9 + size:
                return
            kind, flags = self._received[3:5]
            stream = int.from_bytes(self._received[5:9], "big") & 0x7fffffff
            payload, self._received = self._received[9:9 + size], self._received[9 + size:]
            self._handle(kind, flags, stream, payload)

    def _handle(self, kind, flags, stream, payload):
        if kind == SETTINGS and not flags & ACK:
            for identifier, value in struct.iter_unpack(">HI", payload):
                if identifier == INITIAL_WINDOW_SIZE:
                    for known in self._send_windows:
                        if known:
                            self._send_windows[known] += value - self._stream_window
                    self._stream_window = value
                elif identifier == MAX_FRAME_SIZE:
                    self._max_frame = min(value, 1 << 18)
            self.send(frame(SETTINGS, ACK, 0))
        elif kind == PING and not flags & ACK:
            self.send(frame(PING, ACK, 0, payload))
        elif kind == WINDOW_UPDATE:
            if stream in self._send_windows:
                self._send_windows[stream] += int.from_bytes(payload, "big")
        elif kind == HEADERS:
            self.fields.setdefault(stream, {}).update(self._headers.decode(payload))
        elif kind == RST_STREAM:
            self.ended.add(stream)
        elif kind == GOAWAY:
            raise Closed("told to go away")
        if kind in (DATA, HEADERS) and flags & END_STREAM:
            self.ended.add(stream)

    def close(self):
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
