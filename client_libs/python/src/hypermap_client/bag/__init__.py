"""`hypermap-bag` sends what a robot has recorded with rosbag to an ingest worker.

`options` has the command line, `command` the program. It needs the extra `bag`: pip install
'hypermap-client[bag]'.
"""
