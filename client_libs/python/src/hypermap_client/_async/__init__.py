"""The client for asyncio. The build makes `_sync`, the blocking one, of these files."""
