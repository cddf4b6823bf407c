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


def part(attack, headers, body):
    """The answer to a part of an upload, and where the upload stands then."""
    place = "/v1/" + attack.server.ask("POST", "/v1/uploads", headers={"Upload-Length": "4"})[1]["location"]
    typed = "Content-Type: application/offset+octet-stream\r\nUpload-Offset: 0\r\n"
    seen = statuses(exchange(attack.server, request("PATCH " + place, typed + headers, body)))
    return "%s at %s" % (seen, attack.server.ask("HEAD", place)[1]["upload-offset"])


@case("11 a part of an upload in gzip, whole and cut", expect="415 at 0, 415 at 0")
def coded_part(attack):
    whole = gzip.compress(b"GOOD")
    return ", ".join(part(attack, "Content-Encoding: gzip\r\nContent-Length: %d\r\n" % len(body), body) for body in (whole, whole[:-8]))


@case("11 a part of an upload that ends in a chunk or a trailer that is none", expect="400 at 4, 400 at 4")
def broken_part(attack):
    return ", ".join(part(attack, "Transfer-Encoding: chunked\r\n", b"4\r\nGOOD\r\n" + end) for end in (b"x\r\n", b"0\r\ntrailer\r\n\r\n"))
