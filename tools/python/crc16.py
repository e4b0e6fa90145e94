"""The checksum of an LMS2xx frame, from the telegram listing alone."""


def crc(data):
    """SICK's CRC-16: two data bytes go into every step."""
    value, previous = 0, 0
    for byte in data:
        value = ((value << 1) ^ 0x8005) & 0xFFFF if value & 0x8000 else value << 1
        value ^= previous << 8 | byte
        previous = byte
    return value
