"""gRPC channels, asynchronous (`aio`) and blocking (`blocking`), with the same names in both."""
