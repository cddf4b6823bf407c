"""What servers do to documents for clients that accept it, undone."""
import ctypes
import ctypes.util
import functools
import zlib


@functools.cache
def _brotli():
    """Python's library has none; the service is linked with this one."""
    return ctypes.CDLL(ctypes.util.find_library("brotlidec"))


@functools.cache
def _room(most):
    """Once: clearing and copying 16 MiB for each small document took most of the soak's own time."""
    return ctypes.create_string_buffer(most)


def _unbrotli(body, most):
    size, out = ctypes.c_size_t(most), _room(most)
    if _brotli().BrotliDecoderDecompress(ctypes.c_size_t(len(body)), body, ctypes.byref(size), out) != 1:
        raise ValueError("not brotli, or more than %d bytes of it" % most)
    return ctypes.string_at(out, size.value)


def decoded(coding, body, most=16 << 20):
    """ValueError or zlib.error where the bytes are not of that coding."""
    if coding == "gzip":
        return zlib.decompress(body, 16 + zlib.MAX_WBITS)
    if coding == "br":
        return _unbrotli(body, most)
    if coding == "identity":
        return body
    raise ValueError("nobody asked for " + coding)
