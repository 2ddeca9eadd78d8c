"""A text beside the picture in a PNG file, under a keyword: what its curves are, for a page to read."""

import zlib

SIGNATURE, HEADER = b"\x89PNG\r\n\x1a\n", 33  # bytes up to and with the first chunk, IHDR


def with_text(png: bytes, keyword: str, text: str) -> bytes:
    """The same picture with a chunk tEXt after its header. keyword, text: ASCII, the keyword of 1 to 79 characters.

    Source: PNG specification (third edition), 5.3 and 11.3.3.2.
    """
    content = b"tEXt" + keyword.encode("ascii") + b"\0" + text.encode("ascii")
    chunk = (len(content) - 4).to_bytes(4, "big") + content + zlib.crc32(content).to_bytes(4, "big")
    return png[:HEADER] + chunk + png[HEADER:]
