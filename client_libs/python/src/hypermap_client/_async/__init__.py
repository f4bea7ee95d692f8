"""The client for asyncio. The build generates the blocking client `_sync` from these files."""
