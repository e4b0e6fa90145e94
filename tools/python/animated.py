"""Moving pictures: WebP stills put into one animation, by the container format of RFC 9649."""

import struct


def chunk(name, data):
    return name + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)


def u24(number):
    return struct.pack("<I", number)[:3]


def image(still):
    """The image chunk of a still, lossy or lossless."""
    assert still[:4] == b"RIFF" and still[8:12] == b"WEBP", still[:16]
    at = 12
    while at < len(still):
        name, size = still[at:at + 4], struct.unpack_from("<I", still, at + 4)[0]
        if name in (b"VP8 ", b"VP8L"):
            return chunk(name, still[at + 8:at + 8 + size])
        at += 8 + size + size % 2
    raise ValueError("a still without an image")


def webp(stills, width, height, between_ms):
    """All stills, one after the other, for ever."""
    size = u24(width - 1) + u24(height - 1)
    animation_flag, no_blending = 0x02, 0x02
    body = chunk(b"VP8X", struct.pack("<I", animation_flag) + size) + chunk(b"ANIM", struct.pack("<IH", 0, 0))
    for still in stills:
        frame = u24(0) + u24(0) + size + u24(between_ms) + bytes([no_blending])
        body += chunk(b"ANMF", frame + image(still))
    return b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WEBP" + body
