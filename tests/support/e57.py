"""The pages of an E57 file (ASTM E2807, 8.2): 1020 bytes and their CRC-32C each."""

from __future__ import annotations

__all__ = ["CONTENT", "PAGE", "content_of", "paged"]

PAGE, CONTENT = 1024, 1020


def content_of(data: bytes) -> bytes:
    """A file's bytes without check sums."""
    return b"".join(data[k : k + CONTENT] for k in range(0, len(data), PAGE))


def paged(content: bytes) -> bytes:
    """Content with right check sums, and blanks to the end of the last page."""
    pages = (content[k : k + CONTENT].ljust(CONTENT, b" ") for k in range(0, len(content), CONTENT))
    return b"".join(page + _crc32c(page).to_bytes(4, "big") for page in pages)


def _crc32c(data: bytes) -> int:
    value = 0xFFFFFFFF
    for byte in data:
        value = _CRC[(value ^ byte) & 255] ^ value >> 8
    return value ^ 0xFFFFFFFF


def _crc_row(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    return value


_CRC = tuple(map(_crc_row, range(256)))
