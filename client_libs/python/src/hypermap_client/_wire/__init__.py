"""Conversions between protobuf messages and the client's values."""
