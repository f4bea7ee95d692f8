"""Counts of a run, as JSON and as text."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field

from .._proto import frame_service_pb2 as pb

# Keys of the summary for the outcomes of frames. Those that the worker drops are not among them:
# it only drops frames of streams that allow it.
_OUTCOMES = {
    pb.FRAME_OUTCOME_ACCEPTED: "accepted",
    pb.FRAME_OUTCOME_DUPLICATE: "duplicates",
    pb.FRAME_OUTCOME_REFUSED_LATE: "refused_late",
    pb.FRAME_OUTCOME_INVALID: "invalid",
    pb.FRAME_OUTCOME_CONFLICT: "conflicts",
}


@dataclass
class Summary:
    """Counts of depth images by what became of them, under the names of `hypermap-ingest replay`.

    Each is known, skipped, or counted under the outcome of its acknowledgement, unless the run was
    interrupted or dry.
    """

    robot: str
    frames: int = 0
    known: int = 0
    not_sent: int = 0
    """Frames that a dry run printed."""
    outcomes: Counter[str] = field(default_factory=Counter)
    instances: int = 0
    skipped_frames: Counter[str] = field(default_factory=Counter)
    skipped_instances: Counter[str] = field(default_factory=Counter)
    skipped_input: Counter[str] = field(default_factory=Counter)
    revision: int = 0
    first_refusal: str = ""
    interrupted: bool = False
    seconds: float = 0.0

    def note(self, acknowledgement: pb.FrameAcknowledgement) -> None:
        """Counts the outcome of a frame."""
        outcome = _OUTCOMES.get(acknowledgement.outcome, "dropped")
        self.outcomes[outcome] += 1
        self.revision = max(self.revision, acknowledgement.revision)
        if acknowledgement.bad_instances:
            self.skipped_instances["refused by the worker"] += acknowledgement.bad_instances
        if outcome not in ("accepted", "duplicates") and not self.first_refusal:
            self.first_refusal = f"frame {acknowledgement.sequence}: {acknowledgement.message}"

    def problem(self) -> str:
        """The reason why the run failed as a whole, or an empty text."""
        if self.interrupted:
            return "interrupted; run the same command again to resume"
        taken = self.known + self.not_sent + self.outcomes["accepted"] + self.outcomes["duplicates"]
        if taken > 0 or self.frames == 0:
            return ""
        reasons = [reason for reason, _ in (+self.skipped_frames).most_common(1)]
        return f"no frame could be used: {(reasons or [self.first_refusal])[0]}"

    def to_json(self) -> str:
        """The summary as one line."""
        counts = {name: self.outcomes[name] for name in _OUTCOMES.values()}
        return json.dumps(
            {
                "robot": self.robot,
                "revision": self.revision,
                "frames": self.frames,
                "known": self.known,
                **counts,
                "not_sent": self.not_sent,
                "skipped": self.skipped_frames.total(),
                "instances": self.instances,
                "skipped_frames": dict(+self.skipped_frames),
                "skipped_instances": dict(+self.skipped_instances),
                "skipped_input": dict(+self.skipped_input),
                "first_refusal": self.first_refusal,
                "interrupted": self.interrupted,
                "seconds": round(self.seconds, 3),
            }
        )

    def to_text(self) -> str:
        """The summary in lines for people."""
        counts = {
            **self.outcomes,
            "already stored": self.known,
            "not sent": self.not_sent,
            "skipped": self.skipped_frames.total(),
        }
        parts = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
        lines = [
            f"{self.robot}: {self.frames} frames" + (f": {parts}" if parts else ""),
            f"{self.instances} instances, {self.seconds:.1f} s"
            + (f", revision {self.revision}" if self.revision else ""),
        ]
        for what in ("frames", "instances", "input"):
            for reason, count in sorted((+getattr(self, f"skipped_{what}")).items()):
                lines.append(f"skipped {what}: {count} {reason}")
        if self.first_refusal:
            lines.append(f"first rejected: {self.first_refusal}")
        return "\n".join(lines)
