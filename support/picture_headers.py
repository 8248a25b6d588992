"""Size and comment of a JPEG or PNG, without decoding it."""

from typing import NamedTuple

MOST_PIXELS = 1 << 26  # beyond which a picture is taken for damaged: a few bytes can claim any size
LONGEST_COMMENT = 1 << 14  # bytes
PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8\xff"
END_OF_JPEG, END_OF_PNG = b"\xff\xd9", b"IEND"
LAST = 64  # bytes that some writers append
COMMENT, SCAN, END = 0xFE, 0xDA, 0xD9
NO_SIZE = 0xC4, 0xC8, 0xCC  # of the codes from 0xC0 to 0xCF: tables


class PictureHeader(NamedTuple):
    """`format` is "jpeg" or "png"; width and height are in px; `comment` is that of a JPEG."""

    format: str
    width: int
    height: int
    comment: bytes = b""


def read_picture_header(data: bytes) -> PictureHeader:
    """The header of a JPEG or PNG. Raises ValueError for other data, and for a picture without a size or an end."""
    if data.startswith(PNG):
        if len(data) < 24 or END_OF_PNG not in data[-LAST:]:
            raise ValueError("a PNG without its end")
        width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))
        return _checked(PictureHeader("png", width, height))
    if not data.startswith(JPEG):
        raise ValueError("neither JPEG nor PNG")
    if END_OF_JPEG not in data[-LAST:]:
        raise ValueError("a JPEG without its end")
    size, comment, at = (0, 0), b"", 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        code, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        part = data[at + 4 : at + 2 + length]
        if code in (SCAN, END):
            break
        if 0xC0 <= code <= 0xCF and code not in NO_SIZE and len(part) >= 5:
            size = int.from_bytes(part[3:5], "big"), int.from_bytes(part[1:3], "big")
        elif code == COMMENT and len(part) <= LONGEST_COMMENT:
            comment = part
        at += 2 + max(2, length)
    return _checked(PictureHeader("jpeg", *size, comment))


def _checked(header: PictureHeader) -> PictureHeader:
    if not 0 < header.width * header.height <= MOST_PIXELS:
        raise ValueError(f"a picture of {header.width} x {header.height} px")
    return header
