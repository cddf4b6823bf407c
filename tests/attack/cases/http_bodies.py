"""Finding 11, HTTP: compressed bodies and trailers."""
import gzip

from attack import case, exchange, request, statuses

RASTER = b"no raster, but a body " * 200


def posted(attack, body, coding):
    headers = "Content-Encoding: %s\r\nContent-Length: %d\r\n" % (coding, len(body))
    return statuses(exchange(attack.server, request("POST /v1/datasets?name=a", headers, body)))


@case("11 gzip without its checksum and length", expect="400")
def cut_gzip(attack):
    return posted(attack, gzip.compress(RASTER)[:-8], "gzip")


@case("11 gzip that is whole, in any case of letters", expect="202 202")
def whole_gzip(attack):
    return posted(attack, gzip.compress(RASTER), "gzip") + " " + posted(attack, gzip.compress(RASTER), "GZip")


@case("11 codings that are not read", expect="415 415 415")
def unknown_codings(attack):
    return " ".join(posted(attack, RASTER, coding) for coding in ("zstd", "compress", "gzip, gzip"))


@case("11 a trailer line without a colon", expect="400")
def trailer(attack):
    body = b"4\r\nGOOD\r\n0\r\ntrailer\r\n\r\n"
    return statuses(exchange(attack.server, request("POST /v1/datasets?name=a", "Transfer-Encoding: chunked\r\n", body)))
