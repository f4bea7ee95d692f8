"""Carries out one attack, in step with run.py.

Usage: attacker.py NAME ADDRESS PID DATA_DIR full|short STRETCH idle|equal. STRETCH: how many times
as long as usual it attacks. The last argument is its share of the processors: the time that nobody
else needs, or as much as anybody's. Prints "prepared"; after a line of input it attacks and prints
what the server answered; after another line it checks what must hold afterwards, and prints what
does not. Both are lines of JSON.
"""

import json
import os
import sys

import grpc

import attacks
from site_under_attack import Site


def main():
    name, address, pid, data_dir, form, stretch, share = sys.argv[1:]
    site = Site(address, int(pid), data_dir, form == "short", int(stretch))
    steps = attacks.BY_NAME[name].function(site)
    next(steps)
    if share == "idle":
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    print("prepared", flush=True)
    sys.stdin.readline()
    next(steps)
    print(json.dumps(site.told.most_common()), flush=True)
    sys.stdin.readline()
    wrong = ""
    try:
        next(steps, None)
    except AssertionError as error:
        wrong = str(error)
    except grpc.RpcError as error:
        wrong = f"{error.code().name} {error.details()}"
    print(json.dumps(wrong), flush=True)


if __name__ == "__main__":
    main()
