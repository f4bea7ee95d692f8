"""Fuses recorded drives by the real programs, compares the maps with ground truth, and prints a table.

The drives are rendered scenes, one for each seed, and the drives that are given by their folders. A
scene is named by its seed: those of TUNING may be looked at while parameters are chosen; the others
must not be, and their mean is what counts. With --peer, each drive is also fused by the programs of
another build, and the table tells how the quality compares.

The last line is a JSON object with the means over the scenes that nobody tuned on.
"""

import argparse
import concurrent.futures
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

from processes import BIN, ROOT, Server

TUNING = (1, 2)
SEEDS = range(1, 9)
COLUMNS = {"F1": "f1", "PQ": "pq", "IoU": "mean_iou", "centroid": "centroid_error_m",
           "dup": "duplicates", "recall": "recall", "precision": "precision",
           "shown": "recall_of_shown"}  # of objects that three right detections show


class Drive:
    """A recorded drive: a folder in the layout of the TUM RGB-D dataset, with gt.geojson."""

    def __init__(self, folder, name, is_tuned):
        self.folder, self.name, self.is_tuned = folder, name, is_tuned

    def fuse(self, programs, arguments):
        """Returns the report of `hypermap eval` on the map that the programs of a build make."""
        with tempfile.TemporaryDirectory(prefix="hypermap-") as data_dir:
            with Server(data_dir, program=programs / "hypermapd") as server:
                at = ["--server", server.address]
                replay = [programs / "hypermap-ingest", "replay", *at, self.folder, "--map=drive",
                          f"--detections={arguments.detections}", f"--poses={arguments.poses}",
                          *(["--parameters", arguments.parameters] if arguments.parameters else [])]
                smooth = arguments.smooth and programs == BIN
                occupancy = self.folder / "occupancy.yaml"
                if smooth and occupancy.exists():
                    run(programs / "hypermap", *at, "import", "--map=drive", occupancy)
                with concurrent.futures.ThreadPoolExecutor() as robots:
                    list(robots.map(lambda robot: run(*replay, f"--robot=robot_{robot}"),
                                    range(arguments.robots)))
                if smooth:
                    run(programs / "hypermap-ingest", "smooth", *at, "--map=drive")
                evaluate = [programs / "hypermap", *at, "--json", "eval", "drive",
                            "--layer=semantic", "--truth"]
                report = json.loads(run(*evaluate, self.folder / "gt.geojson"))
                counted = pathlib.Path(data_dir) / "counted.geojson"
                run(BIN.parent / "tests" / "count_detections", self.folder, counted,
                    f"--detections={arguments.detections}")
                of_shown = json.loads(run(*evaluate, counted, "--min-visible-frames=3"))
                report["recall_of_shown"] = of_shown["recall"]
        report["calibration_error"] = report["calibration"]["expected_error"]
        return report


def run(*command):
    """Returns what a command that must succeed prints."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{command[0]}: {done.returncode} {done.stderr}")
    return done.stdout


def rendered(seed, arguments):
    """Renders the scene of a seed, unless an earlier run has."""
    scene = arguments.scenes / f"seed_{seed}_every_{arguments.every}"
    if not (scene / "occupancy.pgm").exists():  # which is written last
        run(BIN / "render_sequence", scene, f"--seed={seed}", f"--every={arguments.every}")
    return Drive(scene, f"seed {seed}", seed in TUNING)


def table(rows):
    """Prints the rows: pairs of a name and a report."""
    print(f"{'':28}" + "".join(f"{name:>10}" for name in [*COLUMNS, "calibr."]))
    for name, report in rows:
        values = [report[key] for key in [*COLUMNS.values(), "calibration_error"]]
        print(f"{name:28}" + "".join(f"{value:10.3f}" for value in values), flush=True)


def mean(reports):
    keys = [*COLUMNS.values(), "calibration_error"]
    return {key: statistics.fmean(report[key] for report in reports) for key in keys}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("drives", nargs="*", type=pathlib.Path, help="folders of recorded drives")
    parser.add_argument("--seeds", type=int, nargs="*", default=list(SEEDS),
                        help="scenes to render (default: 1 to 8)")
    parser.add_argument("--scenes", type=pathlib.Path, default=ROOT / "build" / "fusion" / "scenes",
                        help="folder that keeps rendered scenes")
    parser.add_argument("--every", type=int, default=1, help="render every n-th frame")
    parser.add_argument("--peer", type=pathlib.Path, help="folder with the programs of another build")
    parser.add_argument("--detections", default="detections_noisy.json")
    parser.add_argument("--poses", default="estimated.txt")
    parser.add_argument("--robots", type=int, default=1,
                        help="how many robots send each drive at once, each with the same errors")
    parser.add_argument("--parameters", help="of the fusion strategy, as JSON")
    parser.add_argument("--no_smoothing", dest="smooth", action="store_false",
                        help="leave the poses as they are sent; a peer's always are")
    arguments = parser.parse_args()
    drives = [Drive(folder, folder.name, True) for folder in arguments.drives]
    arguments.scenes.mkdir(parents=True, exist_ok=True)
    drives += [rendered(seed, arguments) for seed in arguments.seeds]
    reports = {}
    for build in filter(None, [BIN, arguments.peer]):
        print(f"\n{build}, {arguments.detections}, {arguments.poses}")
        reports[build] = {drive: drive.fuse(build, arguments) for drive in drives}
        table([(f"{drive.name}{' (tuned)' if drive.is_tuned else ''}", report)
               for drive, report in reports[build].items()])
    untuned = [drive for drive in drives if not drive.is_tuned]
    if not untuned:
        return
    means = {build: mean([found[drive] for drive in untuned]) for build, found in reports.items()}
    print()
    table([(f"mean of {len(untuned)} untuned", means[build]) for build in means])
    summary = {"scenes": len(untuned), **{key: round(value, 4) for key, value in means[BIN].items()}}
    if arguments.peer:
        summary["pq_ratio"] = round(means[BIN]["pq"] / means[arguments.peer]["pq"], 3)
        summary["least_f1_gain"] = round(min(reports[BIN][drive]["f1"] - reports[arguments.peer][drive]["f1"]
                                             for drive in untuned), 3)
    print(json.dumps(summary))


if __name__ == "__main__":
    main()
