"""gRPC channels for asyncio (`aio`) and for threads (`blocking`).

Both modules have the same names, so that the build can make the blocking client of the asynchronous
one. Their calls raise HypermapError.
"""
