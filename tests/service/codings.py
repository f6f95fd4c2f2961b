"""Content codings of answers, undone."""

import ctypes
import ctypes.util
import gzip

_zstd = ctypes.CDLL(ctypes.util.find_library("zstd"))
for call in _zstd.ZSTD_decompress, _zstd.ZSTD_getFrameContentSize:
    call.restype = ctypes.c_size_t
_zstd.ZSTD_getFrameContentSize.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
_zstd.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]


def unzstd(raw, size=None):
    """size: where the frame does not say it."""
    size = size or _zstd.ZSTD_getFrameContentSize(raw, len(raw))
    out = ctypes.create_string_buffer(size)
    assert _zstd.ZSTD_decompress(out, size, raw, len(raw)) == size
    return out.raw


DECODERS = {None: bytes, "gzip": gzip.decompress, "zstd": unzstd}
