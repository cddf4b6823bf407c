"""Finding 11, HTTP: heads that other programs read otherwise, methods and versions that are not served."""
from attack import case, exchange, request, statuses


def answers(attack, requests):
    """The statuses of each connection, every one once."""
    return ", ".join(sorted({statuses(exchange(attack.server, bytes_)) for bytes_ in requests}))


@case("11 Host that is none", expect="400")
def broken_hosts(attack):
    hosts = ["a b/<x>", "u@a", "a:99999999", "", "a:b", "[::1", "[::1]x"]
    return answers(attack, [request("GET /healthz", host=host) for host in hosts])


@case("11 absolute target without Host, or with a user", expect="400")
def absolute_targets(attack):
    no_host = b"GET http://localhost/healthz HTTP/1.1\r\nConnection: close\r\n\r\n"
    return answers(attack, [no_host, request("GET http://u@a/healthz"), request("GET http://u:p@localhost/healthz")])


@case("11 CONNECT, TRACE and methods that nobody knows", expect="501")
def methods(attack):
    return answers(attack, [request("CONNECT a:80"), request("TRACE /"), request("BREW /")])


@case("11 HTTP/2.0 and its preface", expect="505")
def versions(attack):
    return answers(attack, [b"GET / HTTP/2.0\r\nHost: a\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"])


@case("11 an escaped slash is no border of segments", expect="404")
def escaped_slash(attack):
    return answers(attack, [request("GET /v1%2fdatasets"), request("GET /v1%2Fdatasets")])
