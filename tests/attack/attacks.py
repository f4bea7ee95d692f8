"""The attacks by their names, and what the server has to answer."""

import dataclasses
import typing

import connections
import files
import floods
import large_answers
import large_requests
import observations


@dataclasses.dataclass
class Attack:
    name: str
    function: typing.Callable
    # A refusal that the attacker must be told: a regular expression. Empty: none.
    refusal: str = ""
    # A regular expression of a line that the server must log. Empty: none.
    logged: str = ""
    # The most threads that the server may have.
    max_threads: int = 120
    # Whether the clients that are not attacked use the attacked map.
    same_map: bool = False

    def title(self):
        return self.function.__name__.replace("_", " ")


# docs/security.md says how the server defends itself against each, and what is still open.
ALL = [
    Attack("A1", connections.too_many, logged="--max_connections"),
    Attack("A2", floods.rapid_reset, logged="cancelled calls"),
    Attack("A3", large_requests.author_names,
           refusal="INVALID_ARGUMENT metadata x-hypermap-author"),
    Attack("A4", large_requests.area_with_holes,
           refusal="RESOURCE_EXHAUSTED --max_question_vertices"),
    Attack("A4-shape", large_requests.shape_with_holes, refusal="INVALID_ARGUMENT"),
    Attack("A5", files.self_crossing_hulls),
    Attack("B1", large_requests.many_fills, refusal="RESOURCE_EXHAUSTED --max_cells"),
    Attack("B2", large_requests.many_aliases),
    Attack("B3", large_requests.many_frames),
    Attack("B4", large_requests.large_explorations,
           refusal="RESOURCE_EXHAUSTED --max_exploration_bytes"),
    Attack("goal-searches", large_requests.goal_searches,
           refusal="the other exploration was answered"),
    Attack("unreachable-places", large_requests.unreachable_places),
    Attack("B5", large_requests.compressed_message, refusal="UNIMPLEMENTED"),
    Attack("B6", files.unfinished_imports, refusal="RESOURCE_EXHAUSTED --max_scratch_bytes"),
    Attack("B7", large_requests.large_batches,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes", logged="--max_request_bytes"),
    Attack("wide-hulls", large_requests.wide_hulls,
           refusal="RESOURCE_EXHAUSTED --max_content_bytes"),
    Attack("old-observations", observations.old_observations, same_map=True),
    Attack("B8", files.unpacking_member),
    Attack("unclosed-list", files.unclosed_list,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes"),
    # 64 threads are the server's own, so that the maps' threads run out before its open files.
    Attack("B10", large_requests.many_maps, refusal="RESOURCE_EXHAUSTED --max_maps",
           max_threads=90),
    Attack("B11", files.unread_backups, refusal="RESOURCE_EXHAUSTED --max_scratch_bytes"),
    Attack("restored-backups", files.restored_backups, refusal="DATA_LOSS"),
    Attack("slow-readers", connections.slow_readers),
    Attack("random-bytes", connections.random_bytes),
    Attack("endless-streams", floods.endless_streams),
    Attack("header-blocks", floods.header_blocks, logged="a block of headers in many frames"),
    Attack("empty-streams", floods.empty_streams, logged="connections were shut down"),
    Attack("slow-hoarders", floods.slow_hoarders, logged="connections were shut down"),
    Attack("empty-frames", floods.empty_frames, logged="frames that carry nothing"),
    Attack("unread-answers", large_answers.unread_answers,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes"),
    Attack("unread-acknowledgements", large_answers.unread_acknowledgements),
    Attack("unread-commits", large_answers.unread_commits,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes"),
    Attack("wide-reaches", large_answers.wide_reaches,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes"),
    Attack("past-areas", large_answers.past_areas,
           refusal="RESOURCE_EXHAUSTED --max_request_bytes"),
    Attack("stacked-points", large_answers.stacked_points,
           refusal="RESOURCE_EXHAUSTED there are more than"),
]

BY_NAME = {attack.name: attack for attack in ALL}
