"""Errors of a run and of a single frame."""


class BagError(Exception):
    """The bag cannot be used as asked. The message names the file, topic or frame."""


class SkippedFrameError(Exception):
    """One frame cannot be used. The message is a reason that is the same for all such frames."""


class InterruptedRunError(Exception):
    """A signal asked the program to end."""
