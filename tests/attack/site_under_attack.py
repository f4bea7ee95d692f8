"""The server as an attacker sees it, and the notes of the answers that it gave."""

import collections
import contextlib
import re
import time

import grpc

import rpc

_CODES = {code.value[0]: code.name for code in grpc.StatusCode}

# The map that is attacked; the other clients use another one.
PREY = "prey"


class Site:
    """Where and how long to attack, and what the server answered.

    An attack uses `size` for its numbers, so that the short form of the attacks is the same code.
    It goes on `stretch` times as long as it usually does.
    """

    def __init__(self, address, pid, data_dir, is_short, stretch=1):
        self.address = address
        self.pid = pid
        self.data_dir = data_dir
        self.told = collections.Counter()
        self._is_short = is_short
        self._stretch = stretch
        self._end = None

    def size(self, full, short):
        return short if self._is_short else full

    def attacking(self, full_s=5, short_s=1):
        """Whether the attack goes on: for this time, stretched, from the first call on."""
        if self._end is None:
            self._end = time.monotonic() + self._stretch * self.size(full_s, short_s)
        return time.monotonic() < self._end

    def tell(self, text, count=1):
        self.told[text] += count

    def tell_status(self, code, message):
        """Notes an answer: its code with the flags that it names, or else with its first words."""
        name = _CODES.get(code, "reset") if isinstance(code, int) or code is None else code.name
        flags = sorted(set(re.findall(r"--\w+", message)))
        if name in ("OK", "DEADLINE_EXCEEDED", "CANCELLED", "reset"):
            self.tell(name)
        else:
            self.tell(f"{name} {' '.join(flags) or re.sub(r'[0-9]+', 'N', message)[:50]}")

    def tell_result(self, call, timeout_s=None):
        """Waits for a call and notes its result. Returns whether it succeeded."""
        try:
            call.result(timeout_s)
        except grpc.RpcError as error:
            self.tell_status(error.code(), error.details() or "")
            return False
        except grpc.FutureTimeoutError:
            self.tell("no answer")
            return False
        except grpc.FutureCancelledError:
            self.tell("CANCELLED")
            return False
        self.tell("OK")
        return True

    def tell_stream(self, call):
        """Reads a streamed answer to its end and notes its status."""
        with contextlib.suppress(grpc.RpcError):
            for _ in call:
                pass
        self.tell_status(call.code(), call.details() or "")

    def client(self):
        return rpc.Client(self.address)

    def channel(self):
        """Returns a channel with a connection of its own, for calls with encoded messages."""
        return grpc.insecure_channel(self.address, options=[
            ("grpc.use_local_subchannel_pool", 1),
            ("grpc.max_send_message_length", -1), ("grpc.max_receive_message_length", -1)])


def unary(channel, method, message, timeout_s):
    """Starts a call with an encoded message, for example of "EditService/ApplyEdits"."""
    return channel.unary_unary(f"/hypermap.v1.{method}").future(message, timeout=timeout_s)


def server_stream(channel, method, message, timeout_s):
    return channel.unary_stream(f"/hypermap.v1.{method}")(message, timeout=timeout_s)


def client_stream(channel, method, messages, timeout_s):
    return channel.stream_unary(f"/hypermap.v1.{method}").future(messages, timeout=timeout_s)
