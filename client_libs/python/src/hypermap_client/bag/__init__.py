"""`hypermap-bag` sends what a robot has recorded with rosbag to an ingest worker.

`command` has the options and the output. It needs the extra `bag`: pip install
'hypermap-client[bag]'.
"""
